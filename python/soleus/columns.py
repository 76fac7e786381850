"""Names for the numbers of a message, as columns of a table: the same as those of `soleus-inspect recording --csv`.

The labels are part of the layouts; here they are joined.
"""

import ctypes
import dataclasses
import functools
import math

from .layouts import JOINTS, MAX_CONTACT_NODES, NODES, Layout


@dataclasses.dataclass(frozen=True)
class Leaf:
    """A field of numbers somewhere in a message."""

    # How one gets there: names of fields, and numbers of elements of arrays of structs.
    path: tuple
    # `uint32`, `uint64`, `int64` or `float64`, as numpy calls them.
    kind: str
    # A name for each number; None for one that means nothing.
    columns: tuple
    # Numbers of an element of an array that is stored only as long as it is filled.
    cut: int

    @property
    def count(self):
        """Numbers in it; a single number is one."""
        return len(self.columns)


KINDS = {ctypes.c_uint32: "uint32", ctypes.c_uint64: "uint64", ctypes.c_int64: "int64", ctypes.c_double: "float64"}


def leaves(layout, joints):
    """The fields of numbers of a message in the order in which they lie."""
    return list(_leaves(layout, (), "", tuple(joints)))


def _leaves(layout, path, prefix, joints):
    for name, kind in layout._fields_:
        here = (*path, name)
        labels = layout.LABELS.get(name, ())
        counts = []
        while issubclass(kind, ctypes.Array):
            counts.append(kind._length_)
            kind = kind._type_
        if issubclass(kind, Layout):
            if not counts:
                yield from _leaves(kind, here, f"{prefix}{name}.", joints)
                continue
            for index in range(counts[0]):
                yield from _leaves(kind, (*here, index), f"{prefix}{name}.{labels[0][index]}.", joints)
            continue
        if not counts:
            column = None if name == "reserved" else f"{prefix}{name}"
            yield Leaf(here, KINDS[kind], (column,), 0)
            continue
        levels = [_names(label, count, joints) for label, count in zip(labels, counts)]
        columns = functools.reduce(
            lambda before, level: [None if a is None or b is None else f"{a}.{b}" for a in before for b in level],
            levels,
            [f"{prefix}{name}"],
        )
        if name == "reserved":
            columns = [None] * len(columns)
        cut = math.prod(counts[1:]) if labels[0] in (JOINTS, NODES) else 0
        if labels[0] == JOINTS:
            columns = columns[: len(joints) * cut]
        yield Leaf(here, KINDS[kind], tuple(columns), cut)


def _names(label, count, joints):
    if label == JOINTS:
        return [joints[k] if k < len(joints) else None for k in range(count)]
    if label == NODES:
        return [f"node_{k}" for k in range(MAX_CONTACT_NODES)]
    return list(label)
