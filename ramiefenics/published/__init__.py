"""The tables of the published study as printed, and the arithmetic that they must obey."""

from ramiefenics.published.anova import check_anova
from ramiefenics.published.arithmetic import Check, published_checks
from ramiefenics.published.rounding import Printed, recompute
from ramiefenics.published.tables import published_table, published_text

__all__ = [
    "Check",
    "Printed",
    "check_anova",
    "published_checks",
    "published_table",
    "published_text",
    "recompute",
]
