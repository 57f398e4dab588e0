"""Streams a CAN bus, a server of Foxglove's protocol, or MCAP into a session; publishes estimates.

The command `polyest-bridge CONFIGURATION`, or `python3 -m polyest.bridge CONFIGURATION`, runs for
days: it connects again to the daemon and to the source, sends again what the daemon has not
acknowledged, and says in a line of status what it does and what it had to leave out. It needs
`polyest[bridge]`.
"""

from polyest.bridge._bridge import Bridge, Counts
from polyest.bridge._configuration import Configuration, read_configuration

__all__ = ["Bridge", "Configuration", "Counts", "read_configuration"]
