"""The ablation: how much it helps to know that something hides a person, and what it is; docs/ablation.md."""
