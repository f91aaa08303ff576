"""From measured curves to the cause of what a simulation gets wrong."""

from ramiefenics.discovery.inquiry import discover, suspects_of
from ramiefenics.discovery.report.outcome import Discovery

__all__ = ["Discovery", "discover", "suspects_of"]
