//! The closed loop on two loaded FMUs, wired by name, as any co-simulation tool would do it.

use anyhow::Result;

use crate::importer::Instance;
use crate::interface::Variable;
use crate::recording::{CONTROLLER_COLUMNS, PLANT_COLUMNS, Recording, Row};
use crate::simulate::journey::Progress;

/// Variables of one direction: read on one side, written on the other.
struct Wire {
    from: Vec<u32>,
    to: Vec<u32>,
    values: Vec<f64>,
}

impl Wire {
    /// Connects every output of one side with the input of the same name on the other.
    fn new(from: &Instance, to: &Instance) -> Self {
        let pairs: Vec<(u32, u32)> = to
            .interface()
            .with_causality("input")
            .filter_map(|input| {
                let output = from.interface().with_causality("output").find(|output| output.name == input.name)?;
                Some((output.reference, input.reference))
            })
            .collect();
        Self {
            from: pairs.iter().map(|pair| pair.0).collect(),
            to: pairs.iter().map(|pair| pair.1).collect(),
            values: vec![0.0; pairs.len()],
        }
    }

    fn read(&mut self, from: &Instance) -> Result<()> {
        from.get_real(&self.from, &mut self.values)
    }

    fn write(&self, to: &mut Instance) -> Result<()> {
        to.set_real(&self.to, &self.values)
    }
}

/// Drives two initialised instances until `stop` [s], or until the plant has finished its road if `stop` is not given; then a car
/// that makes no progress is given up.
pub fn drive(
    plant: &mut Instance,
    controller: &mut Instance,
    step: f64,
    stop: Option<f64>,
    mut tick: impl FnMut(f64),
) -> Result<Recording> {
    let mut measurements = Wire::new(plant, controller);
    let mut commands = Wire::new(controller, plant);
    let columns = Columns::new(plant, controller)?;
    let mut recording = Recording::default();
    let mut progress = Progress::default();
    let way = plant.interface().variable("s")?.clone();
    let mut steps = 0_u64;
    loop {
        let t = steps as f64 * step;
        recording.rows.push(columns.row(t, plant, controller)?);
        tick(t);
        let over =
            stop.is_none() && (plant.number(&columns.finished)? != 0.0 || !progress.goes_on(t, plant.number(&way)?));
        if over || stop.is_some_and(|stop| t + 0.5 * step > stop) {
            return Ok(recording);
        }
        // Both outputs are read before either side steps: nobody sees the other's future.
        measurements.read(plant)?;
        commands.read(controller)?;
        measurements.write(controller)?;
        commands.write(plant)?;
        plant.do_step(t, step)?;
        controller.do_step(t, step)?;
        steps += 1;
    }
}

/// The variables that are recorded.
struct Columns {
    plant: Vec<Variable>,
    controller: Vec<Variable>,
    finished: Variable,
}

impl Columns {
    fn new(plant: &Instance, controller: &Instance) -> Result<Self> {
        let of = |instance: &Instance, names: &[(&str, &str)]| -> Result<Vec<Variable>> {
            names.iter().map(|(name, _)| instance.interface().variable(name).cloned()).collect()
        };
        Ok(Self {
            plant: of(plant, &PLANT_COLUMNS)?,
            controller: of(controller, &CONTROLLER_COLUMNS)?,
            finished: plant.interface().variable("finished")?.clone(),
        })
    }

    fn row(&self, t: f64, plant: &Instance, controller: &Instance) -> Result<Row> {
        let mut row = Row::default();
        row[0] = t;
        let plant = self.plant.iter().map(|variable| plant.number(variable));
        let controller = self.controller.iter().map(|variable| controller.number(variable));
        for (cell, value) in row[1..].iter_mut().zip(plant.chain(controller)) {
            *cell = value?;
        }
        Ok(row)
    }
}
