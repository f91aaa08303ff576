"""Predicted curves of models with factors and effects, their derivatives, and measured ones."""
