"""Settings of a run."""

from dataclasses import dataclass, field

from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.settings.assemble_config import AssembleConfig
from corporeal.pipeline.settings.fill_config import FillConfig
from corporeal.pipeline.settings.ground_config import GroundConfig
from corporeal.pipeline.settings.segment_config import SegmentConfig
from corporeal.pipeline.settings.simulate_config import SimulateConfig
from corporeal.pipeline.settings.video_config import VideoConfig
from corporeal.reconstruction.reconstruct_config import ReconstructConfig


@dataclass(frozen=True)
class Settings:
    """One configuration per stage."""

    reconstruct: ReconstructConfig = field(default_factory=ReconstructConfig)
    assemble: AssembleConfig = field(default_factory=AssembleConfig)
    describe: DescribeConfig = field(default_factory=DescribeConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    ground: GroundConfig = field(default_factory=GroundConfig)
    fill: FillConfig = field(default_factory=FillConfig)
    simulate: SimulateConfig = field(default_factory=SimulateConfig)
    video: VideoConfig = field(default_factory=VideoConfig)
