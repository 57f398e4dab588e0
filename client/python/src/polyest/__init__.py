"""Estimates uncertain parameters of mechanical models from streamed measurements.

The daemon `polyestd` computes; this package talks to it. A first estimate:

    import pandas, polyest

    problem = (polyest.Problem.builtin("mass_spring_damper")
               .fix(m=1.0, x0=1.0)
               .uncertain("k", polyest.Uniform(31.6, 47.4))
               .uncertain("c", polyest.Uniform(0.1, 0.3))
               .measure("x", noise=0.01))
    with polyest.local() as client:
        estimate = client.estimate(problem, pandas.read_csv("oscillator.csv"))
        print(estimate["k"].mean, estimate["k"].std_dev)

`polyest.aio` is the same for asyncio. Everything is in SI units unless a unit is given.
"""

from polyest import aio, datatree, io, plot, results
from polyest._resume import StreamOptions
from polyest.check import Check, Finding, Remark
from polyest.client import Client, Experiment
from polyest.connecting import LocalClient, connect, estimate, local
from polyest.errors import (
    Aborted,
    AlreadyExists,
    Cancelled,
    DataLoss,
    DeadlineExceeded,
    FailedPrecondition,
    InternalError,
    InvalidInput,
    NotFound,
    PermissionDenied,
    PolyestError,
    ResourceExhausted,
    Unauthenticated,
    Unavailable,
    Unimplemented,
    WrongType,
)
from polyest.estimate_parts import (
    ChannelEstimate,
    Cost,
    Diagnostic,
    Direction,
    ExpansionSummary,
    FilteredQuantity,
    MixtureComponent,
    Parameter,
    TradeOff,
    WindowEstimate,
)
from polyest.estimates import Estimate
from polyest.info import DaemonStatus, Model, Quantity, SessionInfo
from polyest.noise import Noise
from polyest.priors import Beta, Gamma, Lognormal, Normal, TruncatedNormal, Uniform
from polyest.problem import Problem
from polyest.session import Session
from polyest.signals import Chirp, Constant, HalfSineBump, Samples, Sinusoid, Step, Streamed

__version__ = "0.1.0"

__all__ = [
    "Aborted", "AlreadyExists", "Beta", "Cancelled", "ChannelEstimate", "Check", "Chirp", "Client",
    "Constant", "Cost", "DaemonStatus", "DataLoss", "DeadlineExceeded", "Diagnostic", "Direction",
    "Estimate", "ExpansionSummary", "Experiment", "FailedPrecondition", "FilteredQuantity",
    "Finding", "Gamma", "HalfSineBump", "InternalError", "InvalidInput", "LocalClient", "Lognormal",
    "MixtureComponent", "Model", "Noise", "Normal", "NotFound", "Parameter", "PermissionDenied",
    "PolyestError", "Problem", "Quantity", "Remark", "ResourceExhausted", "Samples", "Session",
    "SessionInfo", "Sinusoid", "Step", "StreamOptions", "Streamed", "TradeOff", "TruncatedNormal",
    "Unauthenticated", "Unavailable", "Uniform", "Unimplemented", "WindowEstimate",
    "WrongType", "aio", "connect", "datatree", "estimate", "io", "local", "plot", "results",
]
