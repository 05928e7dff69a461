"""Numbers that the torch module and the exported graph share."""

TINY = 1e-12
"""Added to the squared length of a biternion, to keep it from zero."""
LEAST_LOG_KAPPA, MOST_LOG_KAPPA = -4.0, 8.0
"""The logarithm of the concentration stays within."""
