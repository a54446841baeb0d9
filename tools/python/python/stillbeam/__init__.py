"""Identify a flexible machine's modes, design input shapers, simulate, diagnose, and talk to the board.

The functions are those of the ``stillbeam`` command and give the same numbers:

>>> import stillbeam
>>> found = stillbeam.identify("sweep.csv", input="setpoint_m")       # doctest: +SKIP
>>> shaper = stillbeam.shape(found, type="zvd")                       # doctest: +SKIP
>>> with stillbeam.Board("/dev/ttyACM0") as board:                    # doctest: +SKIP
...     board.upload(shaper)

Units are SI and stand in the names: ``frequency_hz``, ``time_s``, ``tip_deflection_m``. Signals are
one-dimensional NumPy arrays of float64. What cannot be done raises :class:`StillbeamError`, whose message says
what, where, and the remedy; what takes long releases the interpreter's lock and stops at Ctrl-C.
"""

from ._stillbeam import InputError, InternalError, StillbeamError
from .board import Board, Reply
from .diagnosis import Diagnosis, Effect, Parameter, ParameterChange, diagnose
from .identification import Estimate, Fit, Identification, Mode, identify
from .model import Model
from .recording import Recording, read
from .shaper import Shaper, Stage, shape
from .simulation import Move, simulate, simulate_move

__all__ = [
    "Board",
    "Diagnosis",
    "Effect",
    "Estimate",
    "Fit",
    "Identification",
    "InputError",
    "InternalError",
    "Mode",
    "Model",
    "Move",
    "Parameter",
    "ParameterChange",
    "Recording",
    "Reply",
    "Shaper",
    "Stage",
    "StillbeamError",
    "diagnose",
    "identify",
    "read",
    "shape",
    "simulate",
    "simulate_move",
]
