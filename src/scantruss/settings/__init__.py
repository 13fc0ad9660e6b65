"""Settings of a run: a record for each stage, all of them together, and the checks of their values."""

from .records import JUDGE_OUTLIERS as JUDGE_OUTLIERS
from .records import RECORDS as RECORDS
from .records import SAMPLE_SPACING as SAMPLE_SPACING
from .records import SMALLEST_HOLE as SMALLEST_HOLE
from .records import SMOOTH_SAMPLE_SPACING as SMOOTH_SAMPLE_SPACING
from .records import UNITS as UNITS
from .records import BoundarySettings as BoundarySettings
from .records import CheckSettings as CheckSettings
from .records import CleaningSettings as CleaningSettings
from .records import ConstraintSettings as ConstraintSettings
from .records import FrontSettings as FrontSettings
from .records import MemberSettings as MemberSettings
from .records import ReadingSettings as ReadingSettings
from .records import SmoothingSettings as SmoothingSettings
from .records import SurfaceSettings as SurfaceSettings
from .settings import Settings as Settings
from .values import CURVATURE as CURVATURE
from .values import shortest_and_longest as shortest_and_longest
