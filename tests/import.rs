//! The `fmi` crate as an independent importer: it reads the XML with its own schema types and calls the library through
//! its own bindings. It needs libclang to build, so it is behind the feature `fmi-import`; `tests/run` provides that.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common, InstanceCS};
use fmi::fmi2::schema::{Fmi2ModelDescription, ScalarVariable};
use fmi::traits::FmiImport;
use fmu_tools::output::Output;
use fmu_tools::pack::pack;

fn reference(description: &Fmi2ModelDescription, name: &str) -> u32 {
    let mut variables = description.model_variables.variables.iter();
    let found = variables.find(|variable: &&ScalarVariable| variable.name == name);
    found.unwrap_or_else(|| panic!("no variable {name}")).value_reference
}

fn running(import: &Fmi2Import, name: &str) -> InstanceCS {
    let mut instance = import.instantiate_cs(name, false, true).unwrap();
    assert_eq!(Common::get_version(&instance), "2.0");
    instance.setup_experiment(None, 0.0, Some(1.0)).unwrap();
    Common::enter_initialization_mode(&mut instance).unwrap();
    Common::exit_initialization_mode(&mut instance).unwrap();
    instance
}

#[test]
fn another_importer_closes_the_loop() {
    let packed = pack(&Output { quiet: true }).unwrap();
    let plant: Fmi2Import = fmi::import::from_path(&packed.plant).unwrap();
    let controller: Fmi2Import = fmi::import::from_path(&packed.controller).unwrap();
    assert_eq!(plant.model_description().model_name, "VehiclePlant");
    assert_eq!(controller.model_description().model_name, "LpvMpcController");

    let mut measured: Vec<String> = ["v_x", "v_y", "yaw_rate", "e_y", "e_psi"].map(str::to_owned).into();
    for preview in ["kappa_ref", "v_x_ref"] {
        measured.extend((1..=41).map(|index| format!("{preview}[{index}]")));
    }
    let commands = ["delta", "a_x"].map(str::to_owned).to_vec();
    let references = |import: &Fmi2Import, names: &[String]| -> Vec<u32> {
        names.iter().map(|name| reference(import.model_description(), name)).collect()
    };
    let (from_plant, to_controller) = (references(&plant, &measured), references(&controller, &measured));
    let (from_controller, to_plant) = (references(&controller, &commands), references(&plant, &commands));

    let (mut vehicle, mut driver) = (running(&plant, "plant"), running(&controller, "controller"));
    let (mut seen, mut wanted) = (vec![0.0; measured.len()], vec![0.0; commands.len()]);
    let step = 0.01;
    for k in 0..100 {
        vehicle.get_real(&from_plant, &mut seen).unwrap();
        driver.get_real(&from_controller, &mut wanted).unwrap();
        driver.set_real(&to_controller, &seen).unwrap();
        vehicle.set_real(&to_plant, &wanted).unwrap();
        vehicle.do_step(f64::from(k) * step, step, true).unwrap();
        driver.do_step(f64::from(k) * step, step, true).unwrap();
    }
    let time = vehicle.last_successful_time().unwrap();
    assert!((time - 1.0).abs() < 1e-9, "the plant stands at {time} s");
    // One second straight ahead at 14 m/s: the drag is balanced to millimetres a second and nothing turns.
    vehicle.get_real(&from_plant, &mut seen).unwrap();
    assert!((seen[0] - 14.0).abs() < 0.01, "speed {} m/s", seen[0]);
    assert!(seen[3].abs() < 1e-3, "lateral error {} m", seen[3]);
    driver.get_real(&from_controller, &mut wanted).unwrap();
    assert!(wanted[1] > 0.1, "the drag needs an acceleration, got {} m/s2", wanted[1]);
}
