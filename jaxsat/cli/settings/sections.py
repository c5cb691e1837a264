"""The whole of a configuration: the sections that the floors below take, under one roof."""

from jaxsat.cli.settings.fit import FitSection
from jaxsat.given import Earth, Given, Orbit, Sun, Time
from jaxsat.satellites.described import Readings, described
from jaxsat.satellites.numbers import Albedo, SatelliteNumbers, Spacecraft
from jaxsat.satellites.satellite import Satellite
from jaxsat.setting_types import Section
from jaxsat.synthetic.settings import SimulationSettings
from jaxsat.telemetry.raw_sun.settings import CleaningSettings


class Config(Section):
    """All settings of `jaxsat prepare`, `jaxsat fit` and `jaxsat simulate`; one file may serve them all."""

    orbit: Orbit = Orbit()
    time: Time = Time()
    earth: Earth = Earth()
    sun: Sun = Sun()
    spacecraft: Spacecraft = Spacecraft()
    albedo: Albedo = Albedo()
    cleaning: CleaningSettings = CleaningSettings()
    fit: FitSection = FitSection()
    simulate: SimulationSettings = SimulationSettings()

    @property
    def given(self) -> Given:
        """What of orbit, Earth and Sun is not to be found from the session."""
        return Given(orbit=self.orbit, time=self.time, earth=self.earth, sun=self.sun)

    @property
    def numbers(self) -> SatelliteNumbers:
        """The nominal satellite and the Earth's light on it."""
        return SatelliteNumbers(spacecraft=self.spacecraft, albedo=self.albedo)

    def described(self, *, limb: bool = False) -> Satellite:
        """The same as a satellite with sensors, with `limb` of limb angles too; raises `InputError`."""
        fit = self.fit
        return described(
            self.numbers,
            prior=fit.prior_sigma,
            readings=Readings(**{name: getattr(fit, name) for name in Readings.model_fields}),
            limb_sigma_deg=fit.limb_sigma_deg / fit.limb_weight**0.5 if limb else None,
            earth_radius_km=self.earth.radius_km,
        )
