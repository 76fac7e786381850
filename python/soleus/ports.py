"""Subscribing to a topic, and publishing one."""

import ctypes
import dataclasses
import time

import iceoryx2

# How long one sleeps at most before looking by oneself, in case a wake-up got lost (s).
SLICE_S = 0.02
# Topics without wake-ups are looked at so often (s).
LOOK_S = 0.001
# How often one who hears a second publisher asks whether the first still lives (s).
ASK_AGAIN_S = 0.05
# How often one who waits for ever asks whether the domain is still there (s).
ASK_OWNER_S = 0.5


@dataclasses.dataclass
class Counts:
    """What a subscriber has seen so far."""

    taken: int = 0
    # Gaps in the sequence numbers.
    lost: int = 0
    # Messages of a second publisher while the first one lives, not taken.
    strangers: int = 0
    # How often a publisher began anew.
    restarts: int = 0


class Subscriber:
    """Messages of a topic, oldest first. Iterating waits for the next one and ends with the domain."""

    def __init__(self, domain, topic, depth):
        self.topic = topic
        self.counts = Counts()
        self._domain = domain
        self._first = None
        self._previous = {}
        self._asked = 0.0
        kind = topic.message if topic.element is None else iceoryx2.Slice[topic.element]
        name = iceoryx2.ServiceName.new(topic.name)
        builder = domain._node.service_builder(name).publish_subscribe(kind)
        if topic.element is not None:
            builder, depth = builder.user_header(topic.message), 1
        self._service = builder.open()
        self._port = self._service.subscriber_builder().buffer_size(max(1, min(128, depth))).create()
        self._listener = None
        if topic.wakes:
            event = domain._node.service_builder(name).event().open()
            self._listener = event.listener_builder().create()

    def try_next(self):
        """The oldest message not yet taken, a copy; None if there is none. Of a topic of slices, header and list."""
        while (sample := self._port.receive()) is not None:
            # Copied and given back at once: two may be borrowed at a time.
            try:
                if self.topic.element is None:
                    header = message = self.topic.message.from_buffer_copy(sample.payload().contents)
                else:
                    header = self.topic.message.from_buffer_copy(sample.user_header().contents)
                    # By address: the length that version 0.10.0 gives to a slice is in bytes.
                    array = self.topic.element * sample.header.number_of_elements
                    message = header, list(array.from_buffer_copy(array.from_address(sample.payload_ptr)))
                node = sample.header.node_id
            finally:
                sample.delete()
            if self._admits(node, header.header.sequence):
                return message
        return None

    def latest(self):
        """The newest message, those before it dropped; None if none came since the last call."""
        newest = None
        while (message := self.try_next()) is not None:
            newest = message
        return newest

    def wait(self, patience_s):
        """The next message; None if none comes in so many seconds."""
        end = time.monotonic() + patience_s
        while True:
            message = self.try_next()
            left = end - time.monotonic()
            if message is not None or left <= 0.0:
                return message
            self._sleep(left)

    def __iter__(self):
        return self

    def __next__(self):
        while True:
            message = self.wait(ASK_OWNER_S)
            if message is not None:
                return message
            if not self._domain.owner_is_alive():
                raise StopIteration

    def _sleep(self, longest_s):
        if self._listener is None:
            time.sleep(min(longest_s, LOOK_S))
        else:
            # In whole microseconds; none would be for ever.
            micros = max(1, int(1e6 * min(longest_s, SLICE_S)))
            self._listener.timed_wait(iceoryx2.Duration.from_micros(micros))

    def _admits(self, node, sequence):
        """Whether a message may be taken: the first publisher is listened to until it is dead."""
        node_id = node.value
        if self._first is not None and node_id != self._first and node_id not in self._previous:
            now = time.monotonic()
            if now - self._asked < ASK_AGAIN_S or self._lives(self._first):
                self._asked = max(self._asked, now)
                self.counts.strangers += 1
                return False
        if node_id not in self._previous:
            self._first = node_id
            if self.counts.taken:
                self.counts.restarts += 1
                self.counts.lost += sequence
        else:
            self.counts.lost += max(0, sequence - self._previous[node_id] - 1)
        self._previous[node_id] = sequence
        self.counts.taken += 1
        return True

    def _lives(self, node_id):
        for state in iceoryx2.Node.list(iceoryx2.ServiceType.Ipc, self._domain._config):
            view = getattr(state, "_0", None)
            if isinstance(state, iceoryx2.NodeState.Alive) and view is not None and view.id.value == node_id:
                return True
        return False

    def close(self):
        """Gives the place back."""
        for port in (self._listener, self._port):
            if port is not None:
                port.delete()
        self._listener = self._port = self._service = None


class Publisher:
    """The publisher of a topic. Publishing never waits for anybody."""

    def __init__(self, domain, topic):
        self.topic = topic
        self._sequence = 0
        if topic.element is not None:
            raise ValueError(f"{topic.name} is a topic of slices, which this package reads only")
        name = iceoryx2.ServiceName.new(topic.name)
        self._service = domain._node.service_builder(name).publish_subscribe(topic.message).open()
        self._port = self._service.publisher_builder().max_loaned_samples(1).create()
        self._notifier = None
        if topic.wakes:
            event = domain._node.service_builder(name).event().open()
            self._notifier = event.notifier_builder().create()

    def send(self, message):
        """Publishes a message; its sequence number is set here. Tick and robot fingerprint are the sender's."""
        if not isinstance(message, self.topic.message):
            raise TypeError(f"{self.topic.name} carries {self.topic.message.__name__}, not {type(message).__name__}")
        message.header.sequence = self._sequence
        self._port.send_copy(message)
        self._sequence += 1
        if self._notifier is not None:
            self._notifier.notify()

    def serve_late_joiners(self):
        """Gives kept messages to those who subscribed since the last call; sending does so too."""
        self._port.update_connections()

    def close(self):
        """Gives the place back."""
        for port in (self._notifier, self._port):
            if port is not None:
                port.delete()
        self._notifier = self._port = self._service = None


def numbers(array):
    """A field as a numpy array that looks into the message; nested arrays get as many dimensions."""
    import numpy

    if not isinstance(array, ctypes.Array):
        raise TypeError("numbers() takes an array field of a message")
    return numpy.ctypeslib.as_array(array)
