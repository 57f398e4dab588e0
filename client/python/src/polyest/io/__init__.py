"""Reads files and buses of test rigs: MDF, MCAP and CAN, each by an optional extra.

`polyest.io.mdf`, `polyest.io.mcap` and `polyest.io.can` each have `read`, which returns a
`Recording`:

    recording = polyest.io.mdf.read("ride.mf4", {"x": "SUSP.defl", "u": "ROAD.height"})
    estimate = client.estimate(problem, recording)
    session.append(recording)

Every channel keeps the times at which it was sampled. Units are those of the file, and the daemon
converts them; `units` names others. The modules need packages that polyest does not install by
itself: `pip install 'polyest[mdf]'`, `'polyest[mcap]'` or `'polyest[can]'`.
"""

from polyest.io import can, mcap, mdf
from polyest.io._recording import Batch, Recording

__all__ = ["Batch", "Recording", "can", "mcap", "mdf"]
