"""Validation of settings before a run stores them."""

from pathlib import Path

from corporeal.description import describe_config
from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.run_pipeline import RUN_FILE, Settings, read_run_request
from corporeal.pipeline.settings import (
    validate_assemble,
    validate_fill,
    validate_ground,
    validate_segment,
    validate_simulate,
    validate_video,
)
from corporeal.reconstruction import reconstruct_config
from corporeal.vlm import choose_critic, connect_vlm
from corporeal.vlm.annotation_file import read_annotation_mapping


def validate_settings(folder: Path, settings: Settings) -> None:
    """Raise for settings that cannot work: a model without its key, a missing library.

    Settings that the run in ``folder`` already has are not validated again: its answers may be stored, so that no model
    is needed.

    Raises:
        UserError: A key, library or choice is missing or unknown.
    """
    known = read_run_request(folder).settings if (folder / RUN_FILE).exists() else None
    validate_assemble(settings.assemble)
    validate_segment(settings.segment)
    validate_fill(settings.fill)
    validate_simulate(settings.simulate)
    validate_video(settings.video)
    if known is None or known.describe != settings.describe:
        _validate_answers(settings.describe)
    if known is None or known.ground != settings.ground:
        validate_ground(settings.ground)
    if known is None or known.reconstruct != settings.reconstruct:
        reconstruct_config.validate_reconstruct(settings.reconstruct)


def _validate_answers(config: DescribeConfig) -> None:
    describe_config.validate(config)
    if config.annotations is not None:
        read_annotation_mapping(config.annotations)
    for spec in (config.vlm, choose_critic(config.vlm, config.critic)):
        connect_vlm(spec)
