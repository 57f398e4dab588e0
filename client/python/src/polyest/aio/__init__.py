"""Offers the package to asyncio: `connect`, `local`, clients, experiments and sessions.

    async with polyest.aio.local() as client:
        async with await client.session("run7", problem) as session:
            await session.append(frame)
            print((await session.estimate())["k"].mean)

Estimates and results have the classes of the synchronous package. An estimate's own plots that ask
the daemon again (`plot_fit`, …) are not available; `polyest.plot` draws results.
"""

from polyest.aio.client import Client, Experiment
from polyest.aio.connecting import LocalClient, connect, local
from polyest.aio.session import Session

__all__ = ["Client", "Experiment", "LocalClient", "Session", "connect", "local"]
