//! A reference experiment for each FMU, so that anyone can see whether it runs right in their tool: recorded inputs, and the
//! outputs that they must give. Laid out as the layered standard FMI-LS-REF 1.0.0-alpha.1 says.

use anyhow::Result;

use crate::archive::Files;
use crate::importer::{Fmu, Instance};
use crate::interface::{Interface, Kind, Variable};
use crate::xml::Element;

/// Folder of the layered standard.
const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";
/// Communication step of the experiment [s].
const STEP: f64 = 0.01;
/// Number of steps: 8 s reach the middle of the default lane change.
const STEPS: u32 = 800;

/// Adds the experiments of both FMUs to their files: one closed loop gives the inputs of both.
pub fn add(plant: &Fmu, controller: &Fmu, plant_files: &mut Files, controller_files: &mut Files) -> Result<()> {
    let mut p = Side::new(plant, plant.instantiate("plant")?)?;
    let mut c = Side::new(controller, controller.instantiate("controller")?)?;
    for step in 0..STEPS {
        let t = f64::from(step) * STEP;
        let (seen, wanted) = (c.inputs_from(&p)?, p.inputs_from(&c)?);
        c.advance(t, &seen)?;
        p.advance(t, &wanted)?;
    }
    p.save(plant_files)?;
    c.save(controller_files)
}

/// One FMU with what it was given and what it answered.
struct Side<'a> {
    instance: Instance<'a>,
    inputs: Vec<Variable>,
    outputs: Vec<Variable>,
    given: String,
    answered: String,
}

impl<'a> Side<'a> {
    fn new(fmu: &'a Fmu, mut instance: Instance<'a>) -> Result<Self> {
        instance.initialize()?;
        let real = |causality| fmu.interface().with_causality(causality).filter(|variable| variable.kind == Kind::Real);
        let inputs: Vec<Variable> = real("input").cloned().collect();
        // Previews and predictions would make megabytes, and a wall clock repeats nowhere.
        let outputs: Vec<Variable> = real("output")
            .filter(|output| !output.name.contains('[') && output.name != "solve_time")
            .cloned()
            .collect();
        let head = |variables: &[Variable]| {
            let names = variables.iter().map(|variable| format!(",\"{}\"", variable.name));
            format!("\"time\"{}\n", names.collect::<String>())
        };
        let (given, answered) = (head(&inputs), head(&outputs));
        let mut side = Self { instance, inputs, outputs, given, answered };
        side.answer(0.0)?;
        Ok(side)
    }

    /// Values for all inputs: from the other side's output of the same name, or the start value.
    fn inputs_from(&self, other: &Self) -> Result<Vec<f64>> {
        let outputs = other.instance.interface();
        self.inputs
            .iter()
            .map(|input| match outputs.with_causality("output").find(|output| output.name == input.name) {
                Some(output) => other.instance.number(output),
                None => Ok(input.start.as_deref().and_then(|start| start.parse().ok()).unwrap_or_default()),
            })
            .collect()
    }

    fn advance(&mut self, t: f64, values: &[f64]) -> Result<()> {
        self.given += &line(t, values);
        let references: Vec<u32> = self.inputs.iter().map(|input| input.reference).collect();
        self.instance.set_real(&references, values)?;
        self.instance.do_step(t, STEP)?;
        self.answer(t + STEP)
    }

    fn answer(&mut self, t: f64) -> Result<()> {
        let values = self.outputs.iter().map(|output| self.instance.number(output)).collect::<Result<Vec<_>>>()?;
        self.answered += &line(t, &values);
        Ok(())
    }

    fn save(self, files: &mut Files) -> Result<()> {
        files.add(&format!("{FOLDER}/lane_change_in.csv"), self.given)?;
        files.add(&format!("{FOLDER}/lane_change_ref.csv"), self.answered)?;
        files.add(&format!("{FOLDER}/experiments.xml"), experiments().document()?)?;
        files.add(&format!("{FOLDER}/fmi-ls-manifest.xml"), manifest(self.instance.interface()).document()?)
    }
}

fn line(t: f64, values: &[f64]) -> String {
    let cells = values.iter().map(|value| format!(",{value}"));
    format!("{t}{}\n", cells.collect::<String>())
}

fn experiments() -> Element {
    let experiment = Element::new("Experiment")
        .with("name", "lane_change")
        .with(
            "description",
            "The inputs of a double lane change at 14 m/s, held over each step, and the outputs that they give",
        )
        .with("startTime", &0)
        .with("stopTime", &(f64::from(STEPS) * STEP))
        .with("stepSize", &STEP)
        .child(Element::new("Stimuli").with("source", "lane_change_in.csv").with("type", "text/csv"))
        .child(Element::new("References").with("source", "lane_change_ref.csv").with("type", "text/csv"));
    Element::new("Experiments").child(experiment)
}

fn manifest(interface: &Interface) -> Element {
    let related = |source: &str, kind: &str, role: &str, description: &str| {
        Element::new("Related")
            .with("type", kind)
            .with("source", source)
            .with("role", role)
            .with("description", &format!("{}: {description}", interface.model_name))
    };
    Element::new("fmiReferences")
        .with("xmlns:fmi-ls", "http://fmi-standard.org/fmi-ls-manifest")
        .with("fmi-ls:fmi-ls-name", "org.fmi-standard.fmi-ls-ref")
        .with("fmi-ls:fmi-ls-version", "1.0.0-alpha.1")
        .with(
            "fmi-ls:fmi-ls-description",
            "Layered Standard providing information on related files included in an FMU.",
        )
        .child(related("experiments.xml", "application/xml", "experiment/smoke-test", "how to replay the reference"))
        .child(related("lane_change_in.csv", "text/csv", "other", "inputs of the reference"))
        .child(related("lane_change_ref.csv", "text/csv", "result", "outputs of the reference"))
        .child(related("../../documentation/index.html", "text/html", "document", "manual"))
}
