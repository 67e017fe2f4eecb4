"""Calls and the life of their process: threads, its exit, forks, Ctrl-C. Each in a process of its own: a crash is a
result."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="POSIX processes and signals")

ROOT = Path(__file__).parents[2]
# So many seconds may pass between a signal and its KeyboardInterrupt, on a machine that does something else, too.
ANSWER = 2.0
# Nothing here takes nearly so long: whatever does hangs.
HANGS = 120

PRELUDE = """
    import os, signal, sys, threading, time
    import numpy as np
    import edgegrad
    from edgegrad import Renderer
    from tests.support.small_scenes import floating_box

    # A shell starts jobs in the background with this signal ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)

    scene = floating_box()
    path = "meshes.box.vertices"
    adjoint = np.ones((*scene.camera.size, 3))
    tangent = {path: np.ones(scene.meshes["box"].vertices.shape)}
    quick, endless = {"spp": 2, "max_depth": 3}, {"spp": 1 << 24, "max_depth": 3}
"""

ENDLESS = {
    "render": "renderer.render(progress=progress, **endless)",
    "forward": "renderer.render_forward(tangent, progress=progress, **endless)",
    "backward": "renderer.render_backward(adjoint, [path], progress=progress, **endless)",
}


def selected(cases: list[Any], fast: list[Any]) -> list[Any]:
    """All cases; those without a name here are slow tests."""
    return [
        case if case in fast else pytest.param(*([case] if isinstance(case, str) else case), marks=pytest.mark.slow)
        for case in cases
    ]


def run(code: str) -> str:
    """The output of a process that ends without error or warning."""
    script = textwrap.dedent(PRELUDE) + textwrap.dedent(code)
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=HANGS,
        check=False, env={**os.environ, "PYTHONPATH": os.pathsep.join([os.environ.get("PYTHONPATH", ""), str(ROOT)])},
    )
    assert done.returncode == 0, f"{done.returncode}: {done.stdout}{done.stderr}"
    assert not done.stderr
    return done.stdout


# ---- The process's exit ----
@pytest.mark.parametrize(("call", "progress"), selected(
    [(call, progress) for call in ENDLESS for progress in ("None", "told.append", "sleep", "spin")],
    [("render", "None"), ("backward", "told.append"), ("forward", "sleep"), ("backward", "spin")],
))
def test_exit_while_a_daemon_thread_computes(call: str, progress: str) -> None:
    run(f"""
        renderer, told, begun = Renderer(scene, threads=2), [], threading.Event()

        def sleep(fraction):
            begun.set()
            time.sleep(1000.0)

        def spin(fraction):
            begun.set()
            while True:
                pass

        def endlessly():
            progress = {progress}
            {ENDLESS[call]}

        threading.Thread(target=endlessly, daemon=True).start()
        begun.wait(0.5)
    """)


def test_the_main_thread_can_compute_at_exit() -> None:
    """Functions for the exit that were registered before the engine was loaded run after its own."""
    out = run("""
        import atexit
        atexit.register(lambda: print(np.isfinite(renderer.render(**quick)).all()))
        renderer = Renderer(scene, threads=2)
    """)
    assert out == "True\n"


# ---- Forks ----
IN_CHILD = """
        def in_child(work):
            child = os.fork()
            if child == 0:
                signal.alarm(60)  # instead of hanging
                work()
                os._exit(0)
            assert os.waitpid(child, 0)[1] == 0
"""


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_a_forked_process_goes_on_with_everything(threads: int) -> None:
    run(f"""
        {IN_CHILD}
        renderer = Renderer(scene, threads={threads})
        picture, kept = renderer.render(**quick), edgegrad.render(scene, **quick)
        gradient = renderer.render_backward(adjoint, [path], **quick)[path]

        def work():
            assert np.array_equal(renderer.render(**quick), picture)
            assert np.array_equal(renderer.render_backward(adjoint, [path], **quick)[path], gradient)
            assert np.array_equal(edgegrad.render(scene, **quick), kept)
            assert np.array_equal(Renderer(scene, threads={threads}).render(**quick), picture)
            for named in ([path], None):
                scene.meshes["box"].vertices = scene.meshes["box"].vertices + 0.1
                renderer.update(named)
                renderer.render(**quick)

        in_child(work)
        work()
    """)


@pytest.mark.parametrize("call", ENDLESS)
def test_a_fork_while_another_thread_computes(call: str) -> None:
    """Its renderer raises an error of one sentence; all other objects work."""
    run(f"""
        {IN_CHILD}
        expected = edgegrad.render(scene, **quick)
        renderer, begun = Renderer(scene, threads=2), threading.Event()

        def endlessly():
            progress = lambda fraction: begun.set()
            {ENDLESS[call]}

        def work():
            for use in (
                lambda: renderer.render(**quick),
                lambda: renderer.render_backward(adjoint, [path], **quick),
                lambda: renderer.update(),
            ):
                try:
                    use()
                except RuntimeError as error:
                    assert "another thread was using it when this process was forked; make another one" in str(error)
                else:
                    raise AssertionError
            assert np.array_equal(Renderer(scene, threads=2).render(**quick), expected)
            assert np.array_equal(edgegrad.render(scene, **quick), expected)

        threading.Thread(target=endlessly, daemon=True).start()
        begun.wait()
        in_child(work)
    """)


def test_a_fork_while_another_thread_uses_the_functions() -> None:
    run(f"""
        {IN_CHILD}
        expected, begun = edgegrad.render(scene, **quick), threading.Event()

        def work():
            for _ in range(2):
                assert np.array_equal(edgegrad.render(scene, **quick), expected)

        endlessly = lambda: edgegrad.render(scene, progress=lambda fraction: begun.set(), **endless)
        threading.Thread(target=endlessly, daemon=True).start()
        begun.wait()
        in_child(work)
    """)


@pytest.mark.slow
def test_forks_while_other_threads_build_and_update() -> None:
    run(f"""
        {IN_CHILD}
        expected, stop = edgegrad.render(scene, **quick), threading.Event()
        meshes = [floating_box() for _ in range(2)]

        def build():
            while not stop.is_set():
                Renderer(meshes[0], threads=2)

        def update():
            renderer = Renderer(meshes[1], threads=2)
            while not stop.is_set():
                meshes[1].meshes["box"].vertices = meshes[1].meshes["box"].vertices * 1.01
                renderer.update()

        threads = [threading.Thread(target=each) for each in (build, update)]
        for thread in threads:
            thread.start()
        for _ in range(20):
            in_child(lambda: np.array_equal(Renderer(scene, threads=2).render(**quick), expected) or os._exit(1))
        stop.set()
        for thread in threads:
            thread.join()
    """)


@pytest.mark.parametrize("call", ENDLESS)
def test_a_fork_in_a_progress_function(call: str) -> None:
    """The forked call ends with an error, the first goes on, and both renderers are usable."""
    run(f"""
        renderer, children = Renderer(scene, threads=2), []
        picture = renderer.render(**quick)

        class Enough(Exception):
            pass

        def progress(fraction):
            if children:
                raise Enough
            children.append(os.fork())
            if children[0] == 0:
                signal.alarm(60)

        try:
            {ENDLESS[call]}
        except Enough:
            assert children[0] != 0
        except RuntimeError as error:
            assert "forked from its progress function" in str(error), error
            assert np.array_equal(renderer.render(**quick), picture)
            os._exit(0)
        assert os.waitpid(children[0], 0)[1] == 0
        assert np.array_equal(renderer.render(**quick), picture)
    """)


# ---- Ctrl-C ----
# A thread that no lock of Python's delays sends the signal, and notes when.
INTERRUPTED = """
        def seconds_to_answer(work, after):
            sent = []

            def send():
                time.sleep(after)
                sent.append(time.monotonic())
                os.kill(os.getpid(), signal.SIGINT)

            sender = threading.Thread(target=send)
            sender.start()
            try:
                work()
            except KeyboardInterrupt:
                return time.monotonic() - sent[0]
            finally:
                sender.join()
            raise AssertionError("it was at its end")
"""


@pytest.mark.parametrize(("call", "spp", "after"), selected(
    [(call, spp, after) for call in ENDLESS for spp in (1 << 16, 1 << 24) for after in (0.05, 0.3, 1.0)],
    [(call, 1 << 24, 0.3) for call in ENDLESS],
))
def test_ctrl_c_ends_calls(call: str, spp: int, after: float) -> None:
    run(f"""
        {INTERRUPTED}
        renderer, progress = Renderer(scene, threads=2), None
        picture, endless["spp"] = renderer.render(**quick), {spp}

        def work():
            while True:
                {ENDLESS[call]}

        waited = seconds_to_answer(work, {after})
        assert waited < {ANSWER}, waited
        assert np.array_equal(renderer.render(**quick), picture)
    """)


@pytest.mark.parametrize("call", selected(
    ["Renderer(dense, threads=2)", "renderer.update()", "renderer.update([path])", "edgegrad.plan(dense, [path])",
     "dense_gradient()"],
    ["renderer.update()"],
))
def test_ctrl_c_ends_work_on_many_faces(call: str) -> None:
    """And what was being updated is up to date when it is used next."""
    run(f"""
        {INTERRUPTED}
        from tests.torture.dense import dense_scene

        dense = dense_scene(400)
        box = dense.meshes["box"]
        renderer = Renderer(dense, threads=2)
        start = box.vertices

        def dense_gradient():
            dense_renderer = Renderer(dense, threads=2)
            dense_renderer.render_backward(np.ones((*dense.camera.size, 3)), [path], **quick)

        def work():
            k = 0
            while True:
                k += 1
                box.vertices = start * (1.0 + 0.01 * (k % 7))
                {call}

        for after in (0.1, 0.45):
            waited = seconds_to_answer(work, after)
            assert waited < {ANSWER}, waited
        renderer.update()  # the signal may have come between the assignment and the call
        expected, found = Renderer(dense, threads=2).render(**quick), renderer.render(**quick)
        assert np.mean(np.abs(found - expected) > 1e-3 * expected.max()) < 0.01  # their origins differ
    """)


# ---- Threads and progress functions ----
def test_gradients_are_those_of_the_call_s_beginning() -> None:
    """Whatever a progress function does with the arrays that the call was given, and with the scene's."""
    run("""
        from tests.support.rich_scene import everything

        scene = everything()
        wrt = ["meshes.moved.vertices", "materials.clay.base_color", "world.color", "world.strength", "camera.to_world"]
        options = {"spp": 64, "max_depth": 3, "seed": 5}

        def gradient(progress=None):
            scene = everything()
            adjoint = np.random.default_rng(0).normal(size=(*scene.camera.size, 3)).astype(np.float32)
            arrays = [adjoint, scene.world.color, scene.meshes["moved"].vertices, scene.meshes["moved"].transform,
                      scene.materials["clay"].base_color, scene.camera.to_world]
            arrays += [image.pixels for image in scene.images.values()]
            arrays += [layer for mesh in scene.meshes.values() for layer in mesh.attributes.values()]

            def disturb(fraction):
                for array in arrays:
                    array *= 0.5
                scene.world.strength = 17.0

            return Renderer(scene, threads=2).render_backward(adjoint, wrt, progress=progress and disturb, **options)

        expected, found = gradient(), gradient(True)
        for path in wrt:
            assert np.array_equal(expected[path], found[path]), path
    """)


def test_a_call_whose_update_was_interrupted_does_it_anew() -> None:
    """An error half-way through an update leaves no old BVH behind."""
    run("""
        from edgegrad.rendering import native_engine

        renderer = Renderer(scene, threads=2)
        expected = {}
        for factor in (1.0, 1.5):
            scene.meshes["box"].vertices = floating_box().meshes["box"].vertices * factor
            expected[factor] = Renderer(scene, threads=2).render(**quick)
        assert not np.array_equal(*expected.values())
        real = native_engine.Engine._update

        def failing(self, tables):
            self._held = None
            raise MemoryError

        native_engine.Engine._update = failing
        try:
            renderer.update()
        except MemoryError:
            pass
        native_engine.Engine._update = real
        assert np.array_equal(renderer.render(**quick), expected[1.5])
    """)
