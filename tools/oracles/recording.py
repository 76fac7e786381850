#!/usr/bin/env python3
"""Opens a recording with the `mcap` reader of the MCAP project (checksums on) and decodes every message with nothing but the
schemas in the file.

    python3 tools/oracles/recording.py runs/.../walk.mcap

Ends with code 1 if anything cannot be read, if a tick is missing or if sequence numbers have gaps.
"""

import collections
import sys

import environment


def main(path):
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    counts = collections.Counter()
    sequences = collections.defaultdict(list)
    ticks = []
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for metadata in reader.iter_metadata():
            print(f"{metadata.name}: {metadata.metadata}")
        print("attachments:", ", ".join(attachment.name for attachment in reader.iter_attachments()))
        for schema, channel, _, message in reader.iter_decoded_messages():
            counts[(channel.topic, schema.name)] += 1
            # Contact is recorded now and then only; the pattern is a single message.
            if schema.name.startswith("soleus.") and channel.topic not in ("/sole/contact", "/walk/pattern"):
                sequences[channel.topic].append(message.header.sequence)
            if channel.topic == "/truth/robot":
                ticks.append(message.header.tick)
    for (topic, schema), count in sorted(counts.items()):
        print(f"{topic:<22} {schema:<28} {count}")
    complete = lambda found: sorted(found) == list(range(min(found), min(found) + len(found)))
    wrong = [topic for topic, found in sequences.items() if not complete(found)]
    if ticks != list(range(len(ticks))):
        wrong.append("/truth/robot (ticks)")
    if wrong:
        print("gaps in:", ", ".join(wrong))
        return 1
    print(f"{len(ticks)} ticks without a gap")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: recording.py FILE.mcap")
    environment.enter(environment.HERE / ".venv-recording", environment.HERE / "requirements-recording.txt")
    sys.exit(main(sys.argv[1]))
