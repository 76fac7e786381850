"""Recordings as tables."""

import array
import collections
import tomllib

import numpy
import polars
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from .columns import leaves
from .layouts import MAX_JOINTS, TOPICS

LOG = "log"
# Codes of the module `array` for the kinds of numbers.
CODES = {"uint32": "I", "uint64": "Q", "int64": "q", "float64": "d"}


class Unreadable(Exception):
    """A file that is no recording of Soleus, or one that this version of the package does not read."""


def read(path, topic, start_s=None, end_s=None, frame="polars"):
    """One topic of a recording as a table: a row per message, a column per number, named by joint, foot, axis and unit.

    Args:
        path: the recording, `walk.mcap`.
        topic: `robot/state`, `truth/robot`, `health/controller`, ..; `walk/pattern` has a row per phase, `log` a row per
            line.
        start_s, end_s: only messages from this log time (s) on, and before that one; the index finds them.
        frame: `polars` or `pandas`.

    The first column, `log_time_s`, is the log time: the control time in lock-step, universal time in real time.
    """
    with Recording(path) as recording:
        return recording.read(topic, start_s, end_s, frame)


class Recording:
    """An open recording: `facts`, `result`, `files`, `joints`, `topics`, and tables by `read`."""

    def __init__(self, path):
        self.path = path
        self._file = open(path, "rb")
        try:
            self._reader = make_reader(self._file)
            self._summary = self._reader.get_summary()
        except McapError as error:
            self._file.close()
            raise Unreadable(
                f"{path}: not a whole MCAP file ({error or type(error).__name__}); one that a killed recorder left is "
                f"finished by `soleus-inspect recording --recover`"
            ) from error
        if self._summary is None:
            self._file.close()
            raise Unreadable(f"{path}: it has no index; `soleus-inspect recording --recover` makes one")
        self._files = None
        self._decoder = DecoderFactory()
        self._facts = {metadata.name: dict(metadata.metadata) for metadata in self._reader.iter_metadata()}

    def close(self):
        """Closes the file."""
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close()

    @property
    def facts(self):
        """Begin, host, version, scenario, changed keys, pace, units."""
        return self._facts.get("soleus", {})

    @property
    def result(self):
        """How it ended; empty if the recording broke off."""
        return self._facts.get("soleus.result", {})

    @property
    def files(self):
        """The attached files by name: effective configuration, robot."""
        if self._files is None:
            self._files = {attachment.name: attachment.data for attachment in self._reader.iter_attachments()}
        return self._files

    @property
    def joints(self):
        """Names of the joints in the order of the messages."""
        try:
            return tomllib.loads(self.files["robot/robot.toml"].decode())["joints"]
        except (KeyError, ValueError):
            return [f"joint_{k}" for k in range(MAX_JOINTS)]

    @property
    def topics(self):
        """Number of messages by topic, without the slash in front."""
        counts = self._summary.statistics.channel_message_counts if self._summary.statistics else {}
        found = collections.Counter()
        for number, channel in self._summary.channels.items():
            found[channel.topic.lstrip("/")] += counts.get(number, 0)
        return dict(found)

    def messages(self, topic, start_s=None, end_s=None):
        """Log time (s), decoded protobuf message and name of its schema, in the order in which they were recorded."""
        nanoseconds = lambda seconds: None if seconds is None else max(0, round(1e9 * seconds))
        window = {"starting_at": nanoseconds(start_s), "ending_before": nanoseconds(end_s)}
        # By time, messages of no tick would come where the recording had got to.
        window["log_time_order"] = False
        topic = "/" + topic.strip("/")
        decode = None
        for schema, channel, message in self._reader.iter_messages(topics=[topic], **window):
            if decode is None or decode[0] != channel.id:
                decode = channel.id, self._decoder.decoder_for(channel.message_encoding, schema), schema
                if decode[1] is None:
                    raise Unreadable(f"{self.path}: {topic} is not of protobuf messages ({schema.name})")
            yield 1e-9 * message.log_time, decode[1](message.data), decode[2].name

    def read(self, topic, start_s=None, end_s=None, frame="polars"):
        """As `soleus.read`."""
        topic = topic.strip("/")
        if frame not in ("polars", "pandas"):
            raise ValueError(f"frame={frame!r}: polars or pandas")
        if topic == LOG:
            table = self._log(start_s, end_s)
        elif topic in TOPICS:
            table = self._table(TOPICS[topic], start_s, end_s)
        else:
            raise ValueError(f"`{topic}` has no table; there are {', '.join((*TOPICS, LOG))}")
        return table if frame == "polars" else table.to_pandas()

    def _log(self, start_s, end_s):
        levels = {1: "debug", 2: "info", 3: "warning", 4: "error", 5: "fatal"}
        rows = [
            (time_s, levels.get(line.level, "unknown"), line.name, line.message)
            for time_s, line, _ in self.messages(LOG, start_s, end_s)
        ]
        schema = {"log_time_s": polars.Float64, "level": polars.String, "name": polars.String, "message": polars.String}
        return polars.DataFrame(rows, schema=schema, orient="row")

    def _table(self, topic, start_s, end_s):
        layout = topic.message if topic.element is None else topic.element
        fields = leaves(layout, self.joints)
        wanted = {topic.message.WIRE_NAME} if topic.element is None else {"soleus.WalkPatternV1"}
        gathered = [array.array(CODES[leaf.kind]) for leaf in fields]
        times = []
        for time_s, message, name in self.messages(topic.name, start_s, end_s):
            if name not in wanted:
                raise Unreadable(
                    f"{self.path}: {topic.name} is {name}, this package reads {', '.join(wanted)}; "
                    f"for other versions: soleus-inspect recording {self.path} --csv {topic.name}"
                )
            for row in [message] if topic.element is None else message.phases:
                times.append(time_s)
                for leaf, values in zip(fields, gathered):
                    _take(leaf, row, values)
        columns = {"log_time_s": numpy.array(times)}
        for leaf, values in zip(fields, gathered):
            table = numpy.frombuffer(values, dtype=leaf.kind).reshape(len(times), leaf.count)
            used = leaf.count
            if leaf.cut and len(leaf.columns) and ".node_" in leaf.columns[-1]:
                # Places for contact nodes that no message fills are no columns.
                filled = numpy.flatnonzero(table.any(axis=0))
                used = 0 if not filled.size else (int(filled[-1]) // leaf.cut + 1) * leaf.cut
            for index in range(used):
                if leaf.columns[index] is not None:
                    columns[leaf.columns[index]] = numpy.ascontiguousarray(table[:, index])
        return polars.DataFrame(columns)


def _take(leaf, message, values):
    """Appends the numbers of a field; what is not stored is zero."""
    *above, name = leaf.path
    for step in above:
        message = getattr(message, step) if isinstance(step, str) else message[step] if step < len(message) else None
        if message is None:
            values.extend([0] * leaf.count)
            return
    found = getattr(message, name)
    try:
        length = len(found)
    except TypeError:
        values.append(found)
        return
    values.extend(found[: leaf.count])
    if length < leaf.count:
        values.extend([0] * (leaf.count - length))

