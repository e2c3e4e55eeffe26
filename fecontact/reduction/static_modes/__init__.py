"""Rigid, residual and constraint modes, from static solutions of finite-element matrices."""
