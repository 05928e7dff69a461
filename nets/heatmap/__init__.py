"""Where joints are: heat maps over a person's patch, a depth beside each, and whether the joint is hidden."""
