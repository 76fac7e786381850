"""Belong to a domain of Soleus from Python, and read its recordings as tables.

    import soleus

    states = soleus.read("walk.mcap", "robot/state")            # a polars table, a column per number
    with soleus.Domain("lab") as domain:                        # looks on
        for state in domain.subscribe("robot/state"):
            print(state.header.tick, state.foot_wrench_n_nm[0][2])

Messages are the ctypes structures of `soleus.layouts`; the page docs/messages.md says what each field means.
"""

from . import layouts
from .domain import Domain, NoOwner, Occupied
from .place import Unusable
from .ports import Counts, Publisher, Subscriber
from .recording import Recording, Unreadable, read

__all__ = [
    "Counts",
    "Domain",
    "NoOwner",
    "Occupied",
    "Publisher",
    "Recording",
    "Subscriber",
    "Unreadable",
    "Unusable",
    "layouts",
    "read",
]
__version__ = "0.1.0"
