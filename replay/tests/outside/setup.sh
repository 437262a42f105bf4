#!/bin/sh
# The readers that the ignored tests of outside_readers.rs hold the files against, in an environment of their own.
# Usage: sh replay/tests/outside/setup.sh DIRECTORY, then OUTSIDE_READERS=DIRECTORY cargo test -p replay --test
# outside_readers -- --ignored
set -eu
python3 -m venv "$1"
"$1/bin/pip" install --quiet mcap mcap-protobuf-support pymcap-cli pandas polars pyarrow pymavlink rerun-sdk==0.36.3
