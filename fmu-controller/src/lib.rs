//! The adaptive LPV-MPC as an FMI 2.0 co-simulation unit: the variable table and the call into `lpv-mpc`.

mod error;
mod network;
mod variables;

use std::time::Instant;

use error::Error;
use lpv_mpc::adaptation::other_car;
use lpv_mpc::{Adaptation, Controller, Inputs, Output, Parameters, Status};
use model_description::{Category, Experiment, Info, InputDerivative, Log, Model, Outcome, Step, Table};
use serde::{Deserialize, Serialize};

/// The controller with everything that its importer may set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LpvMpcController {
    parameters: Parameters,
    /// File of the network's weights; empty: the one that is built in.
    network_file: String,
    inputs: Inputs,
    controller: Controller,
    /// What the controller shows.
    output: Output,
    /// Wall clock of the last step in which a sample was taken [s].
    solve_time: f64,
}

impl Default for LpvMpcController {
    fn default() -> Self {
        // Until initialisation nothing is known of the network.
        let controller = Controller::new(Parameters::default(), 0.0).expect("a test shows that the defaults are valid");
        Self {
            output: controller.output().clone(),
            controller,
            parameters: Parameters::adaptive(),
            network_file: String::new(),
            inputs: Inputs::default(),
            solve_time: 0.0,
        }
    }
}

impl Model for LpvMpcController {
    const INFO: Info = Info {
        name: "LpvMpcController",
        identifier: "lpv_mpc_controller",
        description: "Adaptive LPV model predictive control of a road vehicle's steering and speed",
        version: env!("CARGO_PKG_VERSION"),
        step_size: 0.001,
        stop_time: 15.0,
        max_step: 10.0,
        max_input_derivative_order: 1,
        max_output_derivative_order: 0,
        directional_derivative: true,
    };

    type Error = Error;

    fn table() -> &'static Table<Self> {
        variables::table()
    }

    fn initialize(&mut self, experiment: &Experiment<'_>, log: &mut dyn Log) -> Result<(), Error> {
        let parameters = self.parameters.clone();
        let adapts = parameters.adaptation != Adaptation::Constant;
        self.controller = if adapts || !self.network_file.trim().is_empty() {
            // A file that is named is read even when it is not used: a wrong name shall not stay unnoticed.
            let network = network::load(&self.network_file, experiment.resources)?;
            if let Some(difference) = other_car(&network, &parameters).filter(|_| adapts) {
                let reason = format!("the network is not of this car, the stiffnesses stay nominal: {difference}");
                log.log(Category::Warning, &reason);
            }
            Controller::with_network(parameters, experiment.start, network)?
        } else {
            Controller::new(parameters, experiment.start)?
        };
        self.output.clone_from(self.controller.output());
        Ok(())
    }

    fn tune(&mut self, _log: &mut dyn Log) -> Result<(), Error> {
        Ok(self.controller.tune(&self.parameters)?)
    }

    fn step(&mut self, step: &Step<'_>, log: &mut dyn Log) -> Result<Outcome, Error> {
        let samples = self.controller.samples();
        let before = Instant::now();
        if step.input_derivatives.is_empty() {
            self.controller.advance(step.t, step.h, &self.inputs)?;
        } else {
            let rates =
                variables::along(step.input_derivatives.iter().map(|d: &InputDerivative| (d.reference, d.value)));
            self.controller.advance_along(step.t, step.h, &self.inputs, &rates)?;
        }
        if self.controller.samples() == samples {
            return Ok(Outcome::Ok);
        }
        self.solve_time = before.elapsed().as_secs_f64();
        self.output.clone_from(self.controller.output());
        let status = self.output.status;
        if log.enabled(Category::Event) {
            log.log(Category::Event, &format!("sample at {} s: {status}", step.t));
        }
        match status {
            Status::Optimal | Status::InteriorPoint | Status::SecondSolver => Ok(Outcome::Ok),
            Status::Estimated | Status::PreviousPlan | Status::SafeStop => {
                let Inputs { v_x, v_y, yaw_rate, e_y, e_psi, .. } = &self.inputs;
                Ok(Outcome::Degraded(format!(
                    "{status} at {} s (v_x {v_x:?}, v_y {v_y:?}, yaw_rate {yaw_rate:?}, e_y {e_y:?}, e_psi {e_psi:?})",
                    step.t
                )))
            }
        }
    }

    fn directional_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Error> {
        if let Some(&reference) = knowns.iter().find(|known| !variables::is_input(**known)) {
            return Err(Error::NoInput(variables::name(reference)));
        }
        let direction = variables::along(knowns.iter().copied().zip(seed.iter().copied()));
        // A model that shows derivatives where this one shows values: the table then reads them.
        let tangent = Self { output: self.controller.along(&direction)?, solve_time: 0.0, ..self.clone() };
        for (slot, &unknown) in sensitivity.iter_mut().zip(unknowns) {
            *slot = variables::real(&tangent, unknown);
        }
        Ok(())
    }
}

model_description::export_fmu!(LpvMpcController);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn committed_description_is_current() {
        model_description::assert_xml_current::<LpvMpcController>("../modelDescription/controller.xml");
    }
}
