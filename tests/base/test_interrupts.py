"""Ctrl-C waits until something whole can be left behind."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time

import pytest

from simplexmesh._base import interrupts as kinds
from simplexmesh._base.interrupts import deferred_interrupts, resend_lost_interrupts


def work(steps):
    for _ in range(steps):
        time.sleep(0.01)


def test_one_is_noted_and_stops_the_next_report():
    said = []
    with deferred_interrupts() as interrupts:
        report = interrupts.checking(lambda share, message: said.append(message))
        report(0.1, "before")
        os.kill(os.getpid(), signal.SIGINT)
        assert interrupts.pending
        with pytest.raises(KeyboardInterrupt):
            report(0.2, "after")
        report(0.3, "measuring what is kept")
    assert said == ["before", "measuring what is kept"]


def test_a_second_one_breaks_off_and_the_handler_comes_back():
    before = signal.getsignal(signal.SIGINT)
    with deferred_interrupts() as interrupts:
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        assert interrupts.pending
    assert signal.getsignal(signal.SIGINT) is before


def test_other_threads_leave_signals_alone():
    before, seen = signal.getsignal(signal.SIGINT), []

    def work():
        with deferred_interrupts() as interrupts:
            seen.append((interrupts.pending, signal.getsignal(signal.SIGINT) is before))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [(False, True)]


def test_one_that_has_to_wait_is_told_that_it_was_heard(monkeypatch, capsys):
    monkeypatch.setattr(kinds, "DELAY", 0.01)
    with deferred_interrupts() as interrupts:
        os.kill(os.getpid(), signal.SIGINT)
        interrupts._timer.join(5)
        assert capsys.readouterr().err == kinds.ACKNOWLEDGMENT


def test_one_that_is_answered_at_once_is_not(monkeypatch, capsys):
    monkeypatch.setattr(kinds, "DELAY", 60.0)
    with deferred_interrupts() as interrupts:
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
    interrupts._timer.join(5)
    assert not interrupts._timer.is_alive()
    assert capsys.readouterr().err == ""


def meet_in_a_callback():
    """Press Ctrl-C where Python is called by C, in a comparison of two numbers."""

    def meeting(_first, _second):
        os.kill(os.getpid(), signal.SIGINT)
        return 0

    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_int))
    ctypes.CDLL(None).qsort((ctypes.c_int * 2)(2, 1), 2, ctypes.sizeof(ctypes.c_int), kind(meeting))


def test_a_second_one_that_meets_a_callback_of_c_still_breaks_off(capsys):
    with deferred_interrupts():
        os.kill(os.getpid(), signal.SIGINT)
        meet_in_a_callback()
        with pytest.raises(KeyboardInterrupt):
            work(500)
    assert capsys.readouterr().err == ""


def test_none_is_lost_in_a_callback_of_c(capsys):
    with resend_lost_interrupts():
        meet_in_a_callback()
        with pytest.raises(KeyboardInterrupt):
            work(500)
    assert capsys.readouterr().err == ""


def test_a_lost_one_is_sent_again_only_within():
    before = sys.unraisablehook
    with resend_lost_interrupts():
        assert sys.unraisablehook is not before
    assert sys.unraisablehook is before
