"""The page's sections: each a function of the ablation; what the data do not hold is left out in one line."""
