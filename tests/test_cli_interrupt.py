"""Ctrl-C waits until something whole can be left behind."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from simplexmesh.cli.interrupt import held_interrupts


def test_one_is_noted_and_stops_the_next_report():
    said = []
    with held_interrupts() as interrupts:
        report = interrupts.watching(lambda share, message: said.append(message))
        report(0.1, "before")
        os.kill(os.getpid(), signal.SIGINT)
        assert interrupts.asked
        with pytest.raises(KeyboardInterrupt):
            report(0.2, "after")
        report(0.3, "measuring what is kept")
    assert said == ["before", "measuring what is kept"]


def test_a_second_one_breaks_off_and_the_handler_comes_back():
    before = signal.getsignal(signal.SIGINT)
    with held_interrupts() as interrupts:
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        assert interrupts.asked
    assert signal.getsignal(signal.SIGINT) is before


def test_other_threads_leave_signals_alone():
    before, seen = signal.getsignal(signal.SIGINT), []

    def work():
        with held_interrupts() as interrupts:
            seen.append((interrupts.asked, signal.getsignal(signal.SIGINT) is before))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [(False, True)]
