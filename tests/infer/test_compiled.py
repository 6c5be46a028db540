"""A user hears of it while code is compiled."""

from time import monotonic, sleep

from numba.core import event

from mlnlite import compiled


def test_what_compiles_long_is_said_again_until_it_is_done(monkeypatch, caplog):
    monkeypatch.setattr(compiled, "_EVERY", 0.02)
    listener, beginning = compiled._announcer(), event.Event("numba:compile", event.EventStatus.START)
    end = monotonic() + 10
    listener.on_start(beginning)
    listener.on_start(beginning)  # a function that the first one calls
    listener.on_end(beginning)
    while len(caplog.records) < 4 and monotonic() < end:
        sleep(0.01)
    listener.on_end(beginning)
    said = [r.getMessage() for r in caplog.records]
    assert said[0].startswith("compiling fast code for the first time")
    assert said[-1] == "compiling more of it"
    sleep(0.1)
    assert len(caplog.records) <= len(said) + 1
