"""The public names of warpdyn and the modules they stand in: `__init__.py` loads them from here when asked for."""

from . import truth as truth
from .answers.contents.block_responses import rocking_response as rocking_response, sliding_response as sliding_response
from .answers.contents.blocks import RockingBlock as RockingBlock, SlidingBlock as SlidingBlock
from .answers.contents.component import Component as Component, RepairCost as RepairCost
from .answers.contents.component_fragility import component_fragility as component_fragility
from .answers.contents.component_losses import (
    component_annual_losses as component_annual_losses,
    component_losses as component_losses,
)
from .answers.contents.component_table import components_from_table as components_from_table
from .answers.contents.overturning import overturning_intervals as overturning_intervals
from .answers.fragility.building_results import building_results as building_results
from .answers.fragility.capacity_curves import fragility_from_capacities as fragility_from_capacities
from .answers.fragility.cloud_curves import fragility_of_cloud as fragility_of_cloud
from .answers.fragility.damage_shares import damage_shares as damage_shares
from .answers.fragility.damaged.state_dependent import state_dependent_fragility as state_dependent_fragility
from .answers.fragility.fragility_curves import fragility as fragility
from .answers.fragility.posterior import fragility_posterior as fragility_posterior
from .answers.fragility.sample_size.level_choice import levels_for as levels_for
from .answers.fragility.sample_size.target_precision import fragility_to as fragility_to
from .answers.reliability.importance_sampling import importance_sampling as importance_sampling
from .answers.reliability.scene_limit_state import SceneLimitState as SceneLimitState
from .answers.reliability.subset_simulation import subset_simulation as subset_simulation
from .answers.risk.annual_rates import annual_rates as annual_rates
from .answers.risk.buildings.annual_losses import building_annual_losses as building_annual_losses
from .answers.risk.collapse_margin import (
    collapse_margin as collapse_margin,
    spectral_shape_factor as spectral_shape_factor,
)
from .answers.risk.disaggregation import disaggregate as disaggregate, rates_by_record as rates_by_record
from .answers.risk.event_losses import event_losses as event_losses
from .answers.risk.exceedance_probability import exceedance_probability as exceedance_probability
from .answers.risk.hazard_curves import HazardCurve as HazardCurve, HazardLogicTree as HazardLogicTree
from .answers.risk.losses import annual_losses as annual_losses, expected_annual_loss as expected_annual_loss
from .answers.risk.measures.comparison import compare_measures as compare_measures
from .answers.risk.measures.conversion import convert_curves as convert_curves
from .answers.risk.measures.surface import fragility_surface as fragility_surface
from .answers.risk.period_based_ductility import period_based_ductility as period_based_ductility
from .answers.risk.portfolio_losses import portfolio_losses as portfolio_losses
from .answers.risk.repeated.damage_in_time import damage_in_time as damage_in_time
from .answers.risk.risk_targets import (
    check_risk_target as check_risk_target,
    risk_targeted_intensity as risk_targeted_intensity,
)
from .answers.risk.storey_losses import storey_losses as storey_losses
from .answers.risk.vulnerability import hazus_loss_ratios as hazus_loss_ratios, vulnerability as vulnerability
from .answers.sensitivity.correlation_ratios import correlation_ratios as correlation_ratios
from .answers.sensitivity.sobol import sobol_indices as sobol_indices
from .answers.sensitivity.tornado import tornado as tornado
from .campaigns.accuracy.method_choice import MethodChoice as MethodChoice
from .campaigns.accuracy.pilot import plan as plan
from .campaigns.incremental.capacities import capacities as capacities
from .campaigns.inference.calibrate import calibrate as calibrate, sample_posterior as sample_posterior
from .campaigns.inference.filters.assimilate import assimilate as assimilate
from .campaigns.inference.measured import MeasuredLoop as MeasuredLoop, MeasuredResponse as MeasuredResponse
from .campaigns.inference.posterior import compare_evidence as compare_evidence, posterior_scatter as posterior_scatter
from .campaigns.integration.settings import Execution as Execution, Integration as Integration
from .campaigns.live import packets as packets
from .campaigns.live.live import Live as Live
from .campaigns.live.saved_state import load_state as load_state, save_state as save_state
from .campaigns.reductions.damage.counts import DamageCounts as DamageCounts
from .campaigns.reductions.damage.losses import DamageLoss as DamageLoss
from .campaigns.reductions.demand_histogram import DemandHistogram as DemandHistogram
from .campaigns.reductions.demand_moments import DemandMoments as DemandMoments, LargestDemand as LargestDemand
from .campaigns.running.histories import Histories as Histories
from .campaigns.running.joining.components import larger_of_components as larger_of_components
from .campaigns.running.joining.join import join as join
from .campaigns.running.outputs import Outputs as Outputs
from .campaigns.running.pushover import pushover as pushover, storey_hysteresis as storey_hysteresis
from .campaigns.running.selections import (
    select_archetype as select_archetype,
    select_event as select_event,
    select_storeys as select_storeys,
)
from .campaigns.running.simulate import simulate as simulate
from .engine import kernels as kernels, laws as laws
from .foundations.core.plausibility import meant_as_given as meant_as_given
from .foundations.files.netcdf import write as write
from .interfaces import hybrid as hybrid, plots as plots
from .interfaces.exchange.nrml_fragility import write_nrml_fragility as write_nrml_fragility
from .interfaces.exchange.nrml_fragility_reader import read_nrml_fragility as read_nrml_fragility
from .interfaces.exchange.nrml_vulnerability import (
    read_nrml_vulnerability as read_nrml_vulnerability,
    write_nrml_vulnerability as write_nrml_vulnerability,
)
from .interfaces.exchange.openquake_tables import (
    read_consequences as read_consequences,
    read_taxonomy_mapping as read_taxonomy_mapping,
    write_consequences as write_consequences,
    write_taxonomy_mapping as write_taxonomy_mapping,
)
from .interfaces.exchange.pelicun import write_pelicun_demands as write_pelicun_demands
from .interfaces.exchange.pelicun_components import read_pelicun_components as read_pelicun_components
from .interfaces.exchange.pelicun_reader import read_pelicun_demands as read_pelicun_demands
from .interfaces.exchange.regional.building_files import write_building_results as write_building_results
from .interfaces.exchange.regional.openquake_damages import write_openquake_damages as write_openquake_damages
from .interfaces.exchange.regional.r2d_results import write_r2d_results as write_r2d_results
from .interfaces.exchange.tables import write_table as write_table
from .interfaces.live_display.display import LiveDisplay as LiveDisplay
from .interfaces.reports.run_report import report as report
from .interfaces.reports.summary import summary as summary
from .model import control as control, inventories as inventories, sites as sites
from .model.ground_motions import records as records
from .model.ground_motions.designs import (
    Cloud as Cloud,
    OneMotionPerStructure as OneMotionPerStructure,
    Stripes as Stripes,
)
from .model.ground_motions.event_sequences import EventSequence as EventSequence
from .model.ground_motions.filtered_noise import (
    CloughPenzien as CloughPenzien,
    FilteredNoise as FilteredNoise,
    JenningsEnvelope as JenningsEnvelope,
    KanaiTajimi as KanaiTajimi,
    WhiteNoise as WhiteNoise,
)
from .model.ground_motions.forces import (
    ForceHistory as ForceHistory,
    FreeVibration as FreeVibration,
    HarmonicForce as HarmonicForce,
    unbalance_force as unbalance_force,
)
from .model.ground_motions.measures.filtered_velocity import FilteredIncrementalVelocity as FilteredIncrementalVelocity
from .model.ground_motions.measures.one_component import (
    AriasIntensity as AriasIntensity,
    AverageSpectralAcceleration as AverageSpectralAcceleration,
    CumulativeAbsoluteVelocity as CumulativeAbsoluteVelocity,
    PeakGroundAcceleration as PeakGroundAcceleration,
    PeakGroundDisplacement as PeakGroundDisplacement,
    PeakGroundVelocity as PeakGroundVelocity,
    SignificantDuration as SignificantDuration,
    SpectralAcceleration as SpectralAcceleration,
    intensity_measures as intensity_measures,
)
from .model.ground_motions.measures.pairs import (
    GeometricMean as GeometricMean,
    LargerComponent as LargerComponent,
    RotatedSpectralAcceleration as RotatedSpectralAcceleration,
)
from .model.ground_motions.motions import GroundMotion as GroundMotion
from .model.ground_motions.motions_at_sites import MotionsAtSites as MotionsAtSites
from .model.ground_motions.pairs_of_motions import PairOfMotions as PairOfMotions
from .model.ground_motions.response_spectra import response_spectra as response_spectra
from .model.ground_motions.roads.profiles import RandomRoad as RandomRoad, RoadBump as RoadBump, SineRoad as SineRoad
from .model.ground_motions.selection.conditional import (
    conditional_spectrum as conditional_spectrum,
    read_openquake_spectrum as read_openquake_spectrum,
)
from .model.ground_motions.selection.correlation import spectral_correlation as spectral_correlation
from .model.ground_motions.selection.models import ground_motion_model as ground_motion_model
from .model.ground_motions.selection.record_spectra import RecordSpectra as RecordSpectra
from .model.ground_motions.selection.result import RecordSelection as RecordSelection
from .model.ground_motions.selection.select import select_records as select_records
from .model.ground_motions.selection.target import TargetSpectrum as TargetSpectrum
from .model.ground_motions.synthetic.motions import synthetic_motions as synthetic_motions
from .model.ground_motions.synthetic.pulses import VelocityPulse as VelocityPulse
from .model.ground_motions.synthetic.regressions import RezaeianDerKiureghian as RezaeianDerKiureghian
from .model.ground_motions.wind.force_stripes import ForceStripes as ForceStripes
from .model.ground_motions.wind.spectra import (
    DavenportSpectrum as DavenportSpectrum,
    KaimalSpectrum as KaimalSpectrum,
    VonKarmanSpectrum as VonKarmanSpectrum,
)
from .model.ground_motions.wind.wind_forces import WindForces as WindForces
from .model.scene.distributions.closed_form import Lognormal as Lognormal, Normal as Normal, Uniform as Uniform
from .model.scene.distributions.numerical import Empirical as Empirical, Truncated as Truncated
from .model.scene.portfolio import Archetype as Archetype, Portfolio as Portfolio
from .model.scene.recording.floor_spectra import FloorSpectra as FloorSpectra
from .model.scene.scatter import (
    GivenFactors as GivenFactors,
    GivenValues as GivenValues,
    RandomFactor as RandomFactor,
    RandomValue as RandomValue,
)
from .model.scene.scene import Scene as Scene
from .model.structures.builders.attachments import (
    with_absorber as with_absorber,
    with_equipment as with_equipment,
)
from .model.structures.builders.chains import lumped_chain as lumped_chain
from .model.structures.builders.flexural_shear_building import FlexuralShearBuilding as FlexuralShearBuilding
from .model.structures.builders.gravity import (
    buckling_factors as buckling_factors,
    geometric_stiffness as geometric_stiffness,
)
from .model.structures.builders.on_soil import (
    FoundationSprings as FoundationSprings,
    foundation_springs as foundation_springs,
    structure_on_soil as structure_on_soil,
)
from .model.structures.builders.rotor import UnbalancedRotor as UnbalancedRotor
from .model.structures.builders.rows.bridge import (
    Bearing as Bearing,
    BridgeSupport as BridgeSupport,
    longitudinal_bridge as longitudinal_bridge,
)
from .model.structures.builders.rows.pounding_row import pounding_row as pounding_row
from .model.structures.builders.tank import HousnerTank as HousnerTank
from .model.structures.builders.torsional_building import (
    PlanFrame as PlanFrame,
    TorsionalBuilding as TorsionalBuilding,
)
from .model.structures.builders.vehicles import HalfCar as HalfCar, QuarterCar as QuarterCar
from .model.structures.frames.fishbone import fishbone as fishbone
from .model.structures.frames.frame import Frame as Frame
from .model.structures.frames.hinged_fishbone import HingedFishbone as HingedFishbone
from .model.structures.frames.hinges.hinged_frame import HingedFrame as HingedFrame
from .model.structures.frames.sticks import equivalent_stick as equivalent_stick
from .model.structures.hazus import hazus_drift_limits as hazus_drift_limits
from .model.structures.lumped.biaxial_spring import BiaxialSpring as BiaxialSpring
from .model.structures.lumped.foundations.footing import (
    CircularFooting as CircularFooting,
    RectangularFooting as RectangularFooting,
    Soil as Soil,
)
from .model.structures.lumped.foundations.uplift import FoundationUplift as FoundationUplift
from .model.structures.lumped.spring import Spring as Spring
from .model.structures.lumped.structure import LumpedStructure as LumpedStructure
from .model.structures.lumped.tanks import (
    housner_cylinder as housner_cylinder,
    housner_rectangle as housner_rectangle,
)
from .model.structures.modal import modal_table as modal_table
from .model.structures.shear_building import LinearSystem as LinearSystem, ShearBuilding as ShearBuilding

__version__: str
