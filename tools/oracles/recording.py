#!/usr/bin/env python3
"""Opens a recording with the `mcap` reader of the MCAP project (checksums on) and decodes every message with nothing but the
schemas in the file.

    python3 tools/oracles/recording.py runs/.../walk.mcap

Ends with code 1 if anything cannot be read, if a tick is missing, if sequence numbers have gaps, if chunks overlap in time by more
than 0.1 s (every seek would open all of them), if messages of a topic run backwards, or if an array of numbers changes its length
(plotters would draw lines through what is not there).
"""

import collections
import sys

import environment


# Of these only now and then one is recorded, and the pattern is a single message.
THINNED = ("/sole/contact", "/health/recorder", "/walk/pattern")


def arrays(message, name=""):
    """Name and length of every array of numbers in a message."""
    for field, value in message.ListFields():
        path = f"{name}.{field.name}"
        if field.is_repeated and field.message_type is None:
            yield path, len(value)
        elif field.is_repeated:
            for index, element in enumerate(value):
                yield from arrays(element, f"{path}.{index}")
        elif field.message_type is not None:
            yield from arrays(value, path)


def overlaps(summary):
    """Chunks that begin more than 0.1 s before the end of one that lies before them."""
    latest, found = 0, 0
    for chunk in sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset):
        found += chunk.message_start_time < latest - 100_000_000
        latest = max(latest, chunk.message_end_time)
    return found


def main(path):
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    counts = collections.Counter()
    sequences = collections.defaultdict(list)
    lengths = collections.defaultdict(set)
    backwards = collections.Counter()
    latest = {}
    ticks = []
    protobuf = DecoderFactory()
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for metadata in reader.iter_metadata():
            print(f"{metadata.name}: {metadata.metadata}")
        print("attachments:", ", ".join(attachment.name for attachment in reader.iter_attachments()))
        overlapping = overlaps(reader.get_summary())
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            counts[(channel.topic, schema.name)] += 1
            backwards[channel.topic] += message.log_time < latest.get(channel.topic, 0)
            latest[channel.topic] = message.log_time
            decoder = protobuf.decoder_for(channel.message_encoding, schema)
            if decoder is None:
                continue
            decoded = decoder(message.data)
            if not schema.name.startswith("soleus."):
                continue
            # Contact has as many nodes as touch or may touch.
            if channel.topic not in THINNED:
                sequences[channel.topic].append(decoded.header.sequence)
                for name, length in arrays(decoded):
                    lengths[channel.topic + name].add(length)
            if channel.topic == "/truth/robot":
                ticks.append(decoded.header.tick)
    for (topic, schema), count in sorted(counts.items()):
        print(f"{topic:<22} {schema:<28} {count}")
    complete = lambda found: sorted(found) == list(range(min(found), min(found) + len(found)))
    wrong = [f"gaps in {topic}" for topic, found in sequences.items() if not complete(found)]
    if ticks != list(range(len(ticks))):
        wrong.append("gaps in the ticks of /truth/robot")
    wrong += [f"{name} has {sorted(found)} numbers" for name, found in lengths.items() if len(found) > 1]
    wrong += [f"{count} messages of {topic} run backwards" for topic, count in backwards.items() if count]
    if overlapping:
        wrong.append(f"{overlapping} chunks overlap")
    if wrong:
        print("\n".join(wrong))
        return 1
    print(f"{len(ticks)} ticks without a gap")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: recording.py FILE.mcap")
    environment.enter(environment.HERE / ".venv-recording", environment.HERE / "requirements-recording.txt")
    sys.exit(main(sys.argv[1]))
