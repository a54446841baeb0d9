"""The same over many machines: thousands of recordings on a cluster, one table, one page.

>>> from stillbeam import fleet
>>> machines = [fleet.Machine(path.stem, [path]) for path in folder.glob("*.csv")]   # doctest: +SKIP
>>> survey = fleet.identify(machines, "survey")                                      # doctest: +SKIP
>>> survey.table                                                                     # doctest: +SKIP

The work is spread by Dask: over the processors of this computer, or over the cluster of the ``client`` that is
given. What is done is written down machine by machine, so a run that was ended goes on where it was, and a
machine whose inputs or options changed is done again.

Needs ``pip install 'stillbeam[fleet]'``.
"""

from .machine import Machine
from .run import diagnose, identify
from .survey import Survey

__all__ = ["Machine", "Survey", "diagnose", "identify"]
