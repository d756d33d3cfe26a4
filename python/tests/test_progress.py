import os
import signal
import sys
import threading
import time

import pytest

import torsio


def test_a_function_is_called_with_share_and_text(dataset):
    calls = []
    torsio.fit(dataset, "lstm", layers="32", epochs=20, progress=lambda share, text: calls.append((share, text)))
    assert len(calls) > 2 and all(0.0 <= share <= 1.0 and text for share, text in calls)
    shares = [share for share, _ in calls]
    assert shares == sorted(shares) and shares[-1] > 0.3, "the scores come after the training"
    assert any("epoch" in text for _, text in calls)


def test_an_exception_of_the_function_stops_the_fit(dataset):
    def stop(share, text):
        raise LookupError("enough")

    start_s = time.monotonic()
    with pytest.raises(LookupError, match="enough"):
        torsio.fit(dataset, "lstm", layers="64", epochs=1000, progress=stop)
    assert time.monotonic() - start_s < 5.0


def test_ctrl_c_stops_a_fit_with_progress(dataset):
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        torsio.fit(dataset, "lstm", layers="64", epochs=1000, progress=lambda share, text: None)


def test_a_block_holds_for_all_functions_in_it_and_ends_with_it(sweep, dataset):
    outer, inner = [], []
    with torsio.progress(lambda share, text: outer.append(text)):
        torsio.simulate("dfki-50", "sweep", duration_s=1.0)
        before = len(outer)
        with torsio.progress(lambda share, text: inner.append(text)):
            torsio.fit(dataset, "lstm", layers="8", epochs=2)
        torsio.fit(dataset, "linear", progress=False)
        assert len(outer) == before and inner
        torsio.fit(dataset, "lstm", layers="8", epochs=2)
        assert len(outer) > before
    after = len(outer)
    torsio.fit(dataset, "lstm", layers="8", epochs=2)
    assert len(outer) == after


def test_other_threads_have_their_own(dataset):
    calls = []
    with torsio.progress(lambda share, text: calls.append(text)):
        thread = threading.Thread(target=lambda: torsio.fit(dataset, "lstm", layers="8", epochs=2))
        thread.start()
        thread.join()
    assert not calls


def test_a_line_is_drawn_on_a_terminal_and_removed(dataset, monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    torsio.fit(dataset, "lstm", layers="32", epochs=60, progress=True)
    drawn = capsys.readouterr().err
    assert "%  epoch" in drawn and drawn.endswith("\r\033[K")


def test_another_type_is_refused(dataset):
    with pytest.raises(torsio.UsageError, match="found int"):
        torsio.fit(dataset, "linear", progress=3)
