from __future__ import annotations

import io
import time

import numpy as np
import pytest

pytest.importorskip("pinocchio")
pytest.importorskip("viser")

from mlnlite.domains.handover import make_scene
from mlnlite.domains.handover.show.viewer import open_view, rescaled, serve, summary
from tests.handover import browser


def test_the_view_serves_and_answers_to_its_sliders():
    server = open_view(make_scene("mug", "to_pour", "L-M"), port=8791)
    try:
        names = {handle.name for handle in server.scene._handle_from_node_name.values()} | set(
            server.scene._handle_from_node_name
        )
        assert {"/object", "/voxels", "/tool", "/region"} <= names
    finally:
        server.stop()


def test_another_level_keeps_the_rest_of_the_scene():
    scene = make_scene("mug", "to_pour", "H")
    low = rescaled(scene, "L")
    assert low.receiver.level.name == "L"
    assert low.thing is scene.thing
    assert np.allclose(low.hand.position, scene.hand.position)


def test_the_summary_names_costs_and_checks():
    from mlnlite.domains.handover import optimise

    scene = make_scene("book", receiver="L")
    words = summary(scene, optimise(scene))
    assert "C_R" in words
    assert words.count("- pass") == 5


def test_serving_ends_when_told():
    serve(make_scene("marker"), port=8792, stop=lambda: True)


@pytest.mark.skipif(browser.CHROMIUM is None, reason="needs a Chromium")
def test_a_browser_shows_the_scene_and_follows_the_method():
    from PIL import Image

    server = open_view(make_scene("mug", "to_pour", "L-M"), port=8793)
    try:
        with browser.page("http://127.0.0.1:8793") as send:
            browser.wait(lambda: "pass safe" in browser.text(send), 60)
            assert "mug" in browser.text(send)
            assert browser.wait(lambda: _colours(Image, send) > 300, 60)
    finally:
        server.stop()
        time.sleep(0.1)


def _colours(image, send):
    """How many colours the canvas side of the page has: an empty scene has few."""
    pixels = np.asarray(image.open(io.BytesIO(browser.picture(send))).convert("RGB"))[:, :900]
    return len(np.unique(pixels.reshape(-1, 3), axis=0))
