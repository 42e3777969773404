#!/usr/bin/env python3
"""Reads a recording with `mcap` and with `AnyReader` of `rosbags`, and prints the results as JSON:
how many messages each topic has, and the last message of each topic. `dimsart/tests/replay.rs` runs it.

    .venv/bin/python tests/oracle/recording.py runs/latest/signals.mcap
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader


def plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value if isinstance(value, (bool, int, float)) else str(value)


def main() -> None:
    path = Path(sys.argv[1])
    with path.open("rb") as file:
        by_mcap = Counter(channel.topic for _, channel, _ in make_reader(file).iter_messages())
    by_rosbags: Counter[str] = Counter()
    last: dict[str, dict[str, object]] = {}
    with AnyReader([path]) as reader:
        for connection, log_time, raw in reader.messages():
            by_rosbags[connection.topic] += 1
            message = reader.deserialize(raw, connection.msgtype)
            fields = {name: plain(value) for name, value in vars(message).items() if not name.startswith("_")}
            last[connection.topic] = {"log_time": log_time, **fields}
    print(json.dumps({"mcap": by_mcap, "rosbags": by_rosbags, "last": last}))


if __name__ == "__main__":
    main()
