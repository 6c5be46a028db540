"""A user hears of it while code is compiled."""

from time import monotonic, sleep

from numba.core import event

from mlnlite import compiled


def test_what_compiles_long_is_said_again_until_it_is_done(monkeypatch, caplog):
    compiled._load_compiler()
    monkeypatch.setattr(compiled, "_EVERY", 0.02)
    compiled._announce_compiling()
    end = monotonic() + 10
    event.start_event("numba:compile")
    event.start_event("numba:compile")  # a function that the first one calls
    event.end_event("numba:compile")
    while len(caplog.records) < 4 and monotonic() < end:
        sleep(0.01)
    event.end_event("numba:compile")
    said = [r.getMessage() for r in caplog.records]
    assert said[0].startswith("compiling fast code for the first time")
    assert said[-1] == "compiling more of it"
    sleep(0.1)
    assert len(caplog.records) <= len(said) + 1
