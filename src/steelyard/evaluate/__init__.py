"""The papers' scores, done right, and as they were published for comparison."""

from steelyard.evaluate.bodies import com_pct as com_pct
from steelyard.evaluate.bodies import inertia_pct as inertia_pct
from steelyard.evaluate.bodies import inertia_scale as inertia_scale
from steelyard.evaluate.bodies import riemannian as riemannian
from steelyard.evaluate.bodies import score as score
from steelyard.evaluate.bodies import score_as_published as score_as_published
from steelyard.evaluate.segments import hausdorff_mm as hausdorff_mm
from steelyard.evaluate.segments import score_segments as score_segments
