"""scene: makes a test of what happens on a rig."""

import inspect
from collections.abc import Awaitable, Callable
from functools import wraps
from typing import Any

from behaviour.rig import Rig, play
from hornbill.sim.bench.recipe import Recipe


def scene(*recipes: Recipe, **options: Any) -> Callable[[Callable[..., Awaitable[None]]], Callable[..., None]]:
    """Decorate a coroutine function `(rig, …)`: a test that plays it with the servos of `recipes`.

    Named `servo`, its second argument is the first servo that is ready. `options` are those of `play`.
    """

    def make(act: Callable[..., Awaitable[None]]) -> Callable[..., None]:
        signature = inspect.signature(act)
        ours = {"rig", "servo"} & set(signature.parameters)

        @wraps(act)
        def test(**arguments: object) -> None:
            async def whole(rig: Rig) -> None:
                servo = {"servo": (await rig.ready())[0]} if "servo" in ours else {}
                await act(rig, **servo, **arguments)

            play(whole, *recipes, **options)

        others = [each for name, each in signature.parameters.items() if name not in ours]
        test.__signature__ = signature.replace(parameters=others)  # pyright: ignore[reportAttributeAccessIssue]
        return test

    return make
