"""scene: makes a test of what happens on a rig; settled: with servos that have run for a while."""

import asyncio
import inspect
from collections.abc import Awaitable, Callable, Iterable
from functools import partial, wraps
from typing import Any

from behaviour.rig import Rig, play
from hornbill.sim.bench.recipe import Recipe

Servos = Recipe | Iterable[Recipe]
Given = Recipe | Callable[[Any], Servos] | Callable[[Any, Any], Servos]


def scene(
    *recipes: Given,
    store: str | Callable[[Any], str] = "sqlite://",
    seed: int | Callable[[Any], int] = 1,
    settle_s: float = 0.0,
    **options: Any,
) -> Callable[[Callable[..., Awaitable[None]]], Callable[..., None]]:
    """Decorate a coroutine function `(rig, …)`: a test that plays it with the servos of `recipes`.

    An argument `servo` is the first servo that is ready, `servos` are all of them by their node IDs, and `lease` is the
    id of a lease. `options` are those of `play`. A recipe or an option that depends on the test's arguments is a
    function of them, by name; it may return several recipes. With `settle_s`, servos have run for that time when the
    test begins.
    """

    options |= {"store": store, "seed": seed}

    def make(act: Callable[..., Awaitable[None]]) -> Callable[..., None]:
        signature = inspect.signature(act)
        ours = {"rig", "servo", "servos", "lease"} & set(signature.parameters)

        @wraps(act)
        def test(**arguments: object) -> None:
            async def whole(rig: Rig) -> None:
                own: dict[str, Any] = {}
                if "servo" in ours:
                    own["servo"] = (await rig.ready())[0]
                if "servos" in ours:
                    found = await rig.ready(len(servos) or 1, within_s=120)
                    own["servos"] = sorted(found, key=lambda servo: servo.node_id or 0)
                if settle_s:
                    await asyncio.sleep(settle_s)
                if "lease" in ours:
                    own["lease"] = await rig.lease()
                await act(rig, **own, **arguments)

            def given(value: Any) -> Any:
                return value(**{name: arguments[name] for name in inspect.signature(value).parameters})

            servos: list[Recipe] = []
            for each in recipes:
                made = given(each) if callable(each) else each
                servos += [made] if isinstance(made, Recipe) else made
            play(whole, *servos, **{name: given(each) if callable(each) else each for name, each in options.items()})

        others = [
            each.replace(kind=each.KEYWORD_ONLY) for name, each in signature.parameters.items() if name not in ours
        ]
        test.__signature__ = signature.replace(parameters=others)  # pyright: ignore[reportAttributeAccessIssue]
        return test

    return make


settled = partial(scene, settle_s=4.0)
"""A scene whose servos have run for a while, so that a save or a restart begins at once."""
