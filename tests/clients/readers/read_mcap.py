"""Reads a log with the mcap library and its protobuf decoder; prints the number of messages of each topic and the last gimbal
command that is not 0."""
import collections
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

counts = collections.Counter()
command = 0.0
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
    assert reader.get_summary() is not None
    for schema, channel, message, decoded in reader.iter_decoded_messages(
        topics=[
            "/computer/start",
            "/computer/frame",
            "/pilot/estimate",
            "/vehicle/truth3d",
            "/verdict",
            "/events",
            "/tf",
        ]
    ):
        assert message.log_time == message.publish_time
        counts[channel.topic] += 1
        if channel.topic == "/computer/frame":
            command = decoded.output.gimbal_rad[0] or command
for topic in sorted(counts):
    print(topic, counts[topic])
print("gimbal", command.hex())
