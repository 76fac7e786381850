"""Joining a domain."""

import time

import iceoryx2

from .layouts import TOPICS, Process
from .place import Life, Place, Taken
from .ports import Publisher, Subscriber


class NoOwner(Exception):
    """Nobody owns the domain: neither a launch nor `soleus-launch serve` runs."""


class Occupied(Exception):
    """A living process of this kind is in the domain already."""


class Domain:
    """A place in a domain: to look on, or as a process, the only one of its kind.

    Args:
        name: the domain's name, as of `soleus-launch --domain NAME`.
        process: which process this one is (`soleus.layouts.Process`, or its name in lower case). Without one it looks
            on and publishes nothing.
        patience_s: how long the owner is waited for.

    Raises:
        NoOwner, Occupied, Unusable.

    Use it in a `with`: an exception that leaves it is told to the other processes as the death of this one.
    """

    def __init__(self, name, process=None, patience_s=5.0):
        self.name = name
        self.place = Place(name)
        self.process = Process[process.upper()] if isinstance(process, str) else process
        self._ports = []
        self._life = None
        end = time.monotonic() + patience_s
        while (owner := self.place.owner()) is None:
            if time.monotonic() >= end:
                raise NoOwner(
                    f"domain `{name}` has no owner after {patience_s:g} s: start a launch with --domain {name}, "
                    f"or soleus-launch serve --domain {name}"
                )
            time.sleep(0.005)
        self._owner = owner
        if self.process is not None:
            try:
                self._life = Life(self.place.member_file(self.process))
            except Taken as other:
                word = self.process.name.lower()
                raise Occupied(f"domain `{name}` has a {word} already: process {other}") from None
        try:
            self._node = self._make_node()
        except BaseException:
            self.close()
            raise

    def _make_node(self):
        iceoryx2.set_log_level(iceoryx2.LogLevel.Error)
        config = iceoryx2.config.default()
        config.global_cfg.prefix = iceoryx2.FileName.new(self.place.prefix)
        config.global_cfg.root_path = iceoryx2.Path.new(str(self.place.root))
        self._config = config
        name = "observer" if self.process is None else self.process.name.lower()
        builder = iceoryx2.NodeBuilder.new().name(iceoryx2.NodeName.new(name)).config(config)
        builder = builder.signal_handling_mode(iceoryx2.SignalHandlingMode.Disabled)
        return builder.create(iceoryx2.ServiceType.Ipc)

    def subscribe(self, topic, depth=128):
        """A `Subscriber` of a topic that keeps up to `depth` messages (at most 128) until they are taken."""
        return self._port(Subscriber(self, self._topic(topic), depth))

    def publish(self, topic):
        """The `Publisher` of a topic of the process that this one is."""
        found = self._topic(topic)
        if found.publisher != self.process:
            needed = found.publisher.name.lower()
            raise ValueError(f'{topic} is published by the {needed}: Domain("{self.name}", process="{needed}")')
        return self._port(Publisher(self, found))

    def owner_is_alive(self):
        """Whether the owner that was there when we joined still is. A few system calls: not for every tick."""
        return self.place.owner() == self._owner

    def close(self, badly=False):
        """Leaves. `badly`: the others hear of it as of a death."""
        for port in self._ports:
            port.close()
        self._ports = []
        self._node = None
        if self._life is not None:
            # After the node: who is seen to have left has left everything.
            self._life.end(badly)
            self._life = None

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self.close(badly=kind is not None and not issubclass(kind, KeyboardInterrupt))

    def _port(self, port):
        self._ports.append(port)
        return port

    @staticmethod
    def _topic(name):
        try:
            return TOPICS[name.strip("/")]
        except KeyError:
            raise ValueError(f"`{name}` is no topic; there are {', '.join(TOPICS)}") from None
