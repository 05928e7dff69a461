"""The on-line system: people tracked in depth images, a planner that chooses whom to analyse, modules that do."""
