"""What is asked of a run is looked at before the run remembers it."""

from pathlib import Path

from corporeal.pipeline import RUN, Settings, reopen
from corporeal.stages import assemble, describe, fill, film, ground, reconstruct, segment, simulate
from corporeal.vlm import connect, critic_of
from corporeal.vlm.annotation import mapping_of


def accept(folder: Path, settings: Settings) -> None:
    """Refuse what could not be done whatever the scene: a model without its key, a missing library.

    What the run in ``folder`` remembers already is not looked at: its answers may be there, and
    then need nobody to give them again.

    Raises:
        UserError: Something is missing or unknown; nothing was changed.

    """
    known = reopen(folder)[1] if (folder / RUN).exists() else None
    for room in (assemble, segment, fill, simulate, film):
        room.accept(getattr(settings, room.__name__.rpartition(".")[2]))
    if known is None or known.describe != settings.describe:
        _answered(settings.describe)
    if known is None or known.ground != settings.ground:
        ground.accept(settings.ground)
    if known is None or known.reconstruct != settings.reconstruct:
        reconstruct.accept(settings.reconstruct)


def _answered(config: describe.DescribeConfig) -> None:
    describe.accept(config)
    if config.annotations is not None:
        mapping_of(config.annotations)
    for spec in (config.vlm, critic_of(config.vlm, config.critic)):
        connect(spec)
