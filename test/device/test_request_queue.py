"""Calls handed from one thread to another."""

from __future__ import annotations

import os
import signal
import threading
from functools import partial

import pytest

from hma_gripper_sim.device.request_queue import Mailbox


@pytest.fixture
def asking():
    """Run a function in another thread while the mailbox is served in this one."""

    def run(mailbox, function):
        results = []
        thread = threading.Thread(target=lambda: results.append(function()))
        thread.start()
        while thread.is_alive():
            mailbox.serve(0.01)
        return results[0]

    return run


def test_a_call_is_carried_out_by_the_owner_and_answered(asking):
    mailbox = Mailbox()
    owner = asking(mailbox, lambda: mailbox.ask(threading.current_thread))
    assert owner is threading.current_thread()


def test_what_a_call_raises_goes_back_to_who_asked(asking):
    mailbox = Mailbox()

    def ask():
        with pytest.raises(ZeroDivisionError):
            mailbox.ask(lambda: 1 / 0)
        return "told"

    assert asking(mailbox, ask) == "told"


def test_calls_keep_their_order():
    mailbox, done = Mailbox(), list[object]()
    for i in range(100):
        mailbox.post(partial(done.append, i))
    mailbox.serve(0.0)
    assert done == list(range(100))


def test_a_flood_does_not_hold_up_the_owner():
    mailbox, done = Mailbox(), list[object]()

    def again():
        done.append(None)
        mailbox.post(again)

    mailbox.post(again)
    mailbox.serve(0.0)
    assert len(done) == 1


def test_it_wakes_for_a_call_and_stops_when_told_to():
    mailbox = Mailbox()
    threading.Timer(0.05, mailbox.post, [mailbox.stop]).start()
    mailbox.serve(60.0)
    assert mailbox.stopped


def test_a_signal_handler_can_stop_it():
    mailbox = Mailbox()
    before = signal.signal(signal.SIGUSR1, lambda *_: mailbox.stop())
    try:
        threading.Timer(0.05, os.kill, [os.getpid(), signal.SIGUSR1]).start()
        mailbox.serve(60.0)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert mailbox.stopped
