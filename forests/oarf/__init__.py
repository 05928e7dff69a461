"""Regression forests without and with occluders (Girshick et al. 2011; Rafi, Gall and Leibe 2015)."""
