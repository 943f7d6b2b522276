//! The vehicle as an FMI 2.0 co-simulation unit: the variable table and the call into `vehicle`.

mod error;
mod road;
mod variables;

use model_description::{Experiment, Info, InputDerivative, Log, Model, Outcome, Step, Table};
use serde::{Deserialize, Serialize};
use vehicle::{Inputs, Measurement, Outputs, Parameters, Preview, STEP_MAX, Vehicle, tyre::Preset};

use error::Error;

/// The vehicle with everything that its importer may set, and what it shows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct VehiclePlant {
    parameters: Parameters,
    /// Name of a tyre preset.
    tyre: String,
    /// Name of a manoeuvre, or a file of comma-separated values.
    road: String,
    inputs: Inputs,
    /// The inputs that act now: the ones set, or after a step with input derivatives what those led to, until set again.
    acting: Inputs,
    /// The vehicle, once initialisation has built it.
    vehicle: Option<Vehicle>,
    measurement: Measurement,
    outputs: Outputs,
    preview: Preview,
}

impl Default for VehiclePlant {
    fn default() -> Self {
        let parameters = Parameters::default();
        Self {
            tyre: parameters.tyre.name().to_owned(),
            road: "double_lane_change".to_owned(),
            parameters,
            inputs: Inputs::default(),
            acting: Inputs::default(),
            vehicle: None,
            measurement: Measurement::default(),
            outputs: Outputs::default(),
            preview: Preview::default(),
        }
    }
}

impl VehiclePlant {
    fn vehicle(&self) -> &Vehicle {
        self.vehicle.as_ref().expect("the life cycle lets nothing be computed before initialisation has built it")
    }

    /// A plant whose calculated values are these derivatives.
    fn tangent(outputs: Outputs, preview: Preview) -> Self {
        Self {
            measurement: Measurement {
                v_x: outputs.v_x_true,
                v_y: outputs.v_y_true,
                yaw_rate: outputs.yaw_rate_true,
                e_y: outputs.e_y_true,
                e_psi: outputs.e_psi_true,
            },
            outputs,
            preview,
            ..Self::default()
        }
    }
}

impl Model for VehiclePlant {
    const INFO: Info = Info {
        name: "VehiclePlant",
        identifier: "vehicle_plant",
        description: "Nonlinear single-track vehicle on a road with wind, actuators and sensors",
        version: env!("CARGO_PKG_VERSION"),
        step_size: 0.001,
        stop_time: 15.0,
        max_step: STEP_MAX,
        max_input_derivative_order: 1,
        max_output_derivative_order: 1,
        directional_derivative: true,
    };

    type Error = Error;

    fn table() -> &'static Table<Self> {
        variables::table()
    }

    fn initialize(&mut self, experiment: &Experiment<'_>, _log: &mut dyn Log) -> Result<(), Error> {
        self.parameters.tyre = Preset::named(&self.tyre)?;
        let road = road::load(&self.road, &self.parameters, experiment.resources)?;
        let vehicle = Vehicle::new(self.parameters.clone(), road)?.under(self.inputs)?;
        self.measurement = vehicle.measurement();
        self.vehicle = Some(vehicle);
        Ok(())
    }

    fn step(&mut self, step: &Step<'_>, _log: &mut dyn Log) -> Result<Outcome, Error> {
        let rates = variables::along(step.input_derivatives.iter().map(|d: &InputDerivative| (d.reference, d.value)));
        let vehicle = self.vehicle.as_mut().expect("a step comes after initialisation");
        vehicle.advance_along(step.h, &self.inputs, &rates)?;
        self.acting = vehicle.truth().inputs;
        self.measurement = vehicle.measurement();
        Ok(Outcome::Ok)
    }

    fn refresh(&mut self) {
        let vehicle = self.vehicle();
        (self.outputs, self.preview) = (vehicle.outputs_under(&self.acting), vehicle.preview());
    }

    fn output_derivative(&self, reference: u32, _order: u32) -> Option<f64> {
        let vehicle = self.vehicle();
        let tangent = Self::tangent(vehicle.outputs_rate(&self.acting), vehicle.preview_rate());
        variables::real(&tangent, reference)
    }

    fn directional_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Error> {
        if let Some(&reference) = knowns.iter().find(|known| !variables::is_input(**known)) {
            return Err(Error::NoDerivative(variables::name(reference)));
        }
        let along = variables::along(knowns.iter().copied().zip(seed.iter().copied()));
        let tangent = Self::tangent(self.vehicle().outputs_along(&self.acting, &along), Preview::default());
        for (slot, &unknown) in sensitivity.iter_mut().zip(unknowns) {
            *slot = variables::real(&tangent, unknown).unwrap_or(0.0);
        }
        Ok(())
    }
}

model_description::export_fmu!(VehiclePlant);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn committed_description_is_current() {
        model_description::assert_xml_current::<VehiclePlant>("../modelDescription/plant.xml");
    }
}
