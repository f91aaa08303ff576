"""From measured curves to the cause of what a simulation gets wrong."""

from ramiefenics.discovery.inquiry import Discovery, discover

__all__ = ["Discovery", "discover"]
