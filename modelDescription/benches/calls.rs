//! Does a call through the C interface cost at most 100 ns more than the same thing done natively?
//!
//! The model is as cheap as a model can be, so what is measured is the interface; the FMI functions are called through pointers that
//! the compiler cannot see through, as an importer calls them. Natively, 83 values are a field and a slice that is copied. Each time
//! is the best of many turns that all calls take one after the other.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "a bench")]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::hint::black_box;
use std::ptr;
use std::time::Instant;

use model_description::{Experiment, Info, Log, Model, Outcome, Step, Table, variables};
use serde::{Deserialize, Serialize};

/// Repetitions of a turn, enough to make the clock's resolution nothing.
const REPETITIONS: u32 = 2_000;
/// Turns of each call.
const TURNS: usize = 200;

/// Adds its input.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Adder {
    u: f64,
    preview: Vec<f64>,
    sum: f64,
}

impl Default for Adder {
    fn default() -> Self {
        Self { u: 0.0, preview: vec![0.0; 82], sum: 0.0 }
    }
}

impl Model for Adder {
    const INFO: Info = Info { name: "Adder", identifier: "adder", description: "Adds its input", ..Info::PLAIN };
    type Error = String;

    fn table() -> &'static Table<Self> {
        variables! { Adder;
            Input  u ["1"] "Input", min -1e6, max 1e6 => u;
            Input  a [41] ["1"] "First preview", min -1e6, max 1e6 => |m, k| m.preview[k];
            Input  b [41] ["1"] "Second preview", min -1e6, max 1e6 => |m, k| m.preview[41 + k];
            Output sum ["1"] "Sum of the input", depends &[] => sum;
        }
    }

    fn initialize(&mut self, _: &Experiment<'_>, _: &mut dyn Log) -> Result<(), String> {
        Ok(())
    }

    #[inline(never)]
    fn step(&mut self, step: &Step<'_>, _: &mut dyn Log) -> Result<Outcome, String> {
        self.sum += step.h * self.u;
        Ok(Outcome::Ok)
    }
}

model_description::export_fmu!(Adder);

#[repr(C)]
struct Callbacks([*mut c_void; 5]);

type Get = unsafe extern "C" fn(*mut c_void, *const c_uint, usize, *mut f64) -> c_int;
type Set = unsafe extern "C" fn(*mut c_void, *const c_uint, usize, *const f64) -> c_int;
type DoStep = unsafe extern "C" fn(*mut c_void, f64, f64, c_int) -> c_int;

#[rustfmt::skip]
unsafe extern "C" {
    fn fmi2Instantiate(name: *const c_char, kind: c_int, guid: *const c_char, resources: *const c_char, callbacks: *const Callbacks, visible: c_int, logging: c_int) -> *mut c_void;
    fn fmi2EnterInitializationMode(c: *mut c_void) -> c_int;
    fn fmi2ExitInitializationMode(c: *mut c_void) -> c_int;
    fn fmi2FreeInstance(c: *mut c_void);
    fn fmi2GetReal(c: *mut c_void, vr: *const c_uint, n: usize, value: *mut f64) -> c_int;
    fn fmi2SetReal(c: *mut c_void, vr: *const c_uint, n: usize, value: *const f64) -> c_int;
    fn fmi2DoStep(c: *mut c_void, t: f64, h: f64, no_rollback: c_int) -> c_int;
}

fn instance() -> *mut c_void {
    let xml = model_description::model_description::<Adder>().unwrap();
    let guid = CString::new(xml.split("guid=\"").nth(1).unwrap().split('"').next().unwrap()).unwrap();
    let callbacks = Callbacks([ptr::null_mut(); 5]);
    unsafe {
        let component = fmi2Instantiate(c"one".as_ptr(), 1, guid.as_ptr(), ptr::null(), &raw const callbacks, 0, 0);
        assert!(!component.is_null());
        assert_eq!(fmi2EnterInitializationMode(component) + fmi2ExitInitializationMode(component), 0);
        component
    }
}

/// A call and the same thing done natively; either as often as told.
struct Pair<'a> {
    name: &'static str,
    native: Box<dyn FnMut(u32) + 'a>,
    call: Box<dyn FnMut(u32) + 'a>,
}

/// Time of one repetition [ns], the best of many turns that all take one after the other.
fn best(pairs: &mut [Pair<'_>]) -> Vec<[f64; 2]> {
    let mut best = vec![[f64::INFINITY; 2]; pairs.len()];
    for _ in 0..TURNS {
        for (best, pair) in best.iter_mut().zip(&mut *pairs) {
            for (best, body) in best.iter_mut().zip([&mut pair.native, &mut pair.call]) {
                let start = Instant::now();
                body(REPETITIONS);
                *best = best.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(REPETITIONS));
            }
        }
    }
    best
}

fn main() {
    let component = instance();
    let (get, set, do_step): (Get, Set, DoStep) = black_box((fmi2GetReal, fmi2SetReal, fmi2DoStep));
    let sum = [83];
    let all: Vec<c_uint> = (0..83).collect();
    // No run of consecutive references is longer than one: what an importer does that sorts its variables by name.
    let scattered: Vec<c_uint> = (0..83).map(|k| (k * 37) % 83).collect();
    let inputs = vec![0.5; 83];

    let native_get = |n: usize| {
        let (model, mut values) = (Adder::default(), vec![0.0; 83]);
        move |repetitions: u32| {
            for _ in 0..repetitions {
                let model = black_box(&model);
                values[0] = model.u;
                values[1..n].copy_from_slice(&model.preview[..n - 1]);
                black_box(&mut values);
            }
        }
    };
    let native_set = |n: usize| {
        let (mut model, values) = (Adder::default(), vec![0.5; 83]);
        move |repetitions: u32| {
            for _ in 0..repetitions {
                let values = black_box(&values);
                model.u = values[0];
                model.preview[..n - 1].copy_from_slice(&values[1..n]);
                black_box(&mut model);
            }
        }
    };
    let fmi_get = |references: &[c_uint]| {
        let (references, mut values) = (references.to_vec(), vec![0.0; 83]);
        move |repetitions: u32| {
            for _ in 0..repetitions {
                // SAFETY: both arrays have as many elements as told.
                let status = unsafe { get(component, references.as_ptr(), references.len(), values.as_mut_ptr()) };
                assert_eq!(status, 0);
            }
        }
    };
    let fmi_set = |references: &[c_uint]| {
        let (references, values) = (references.to_vec(), inputs.clone());
        move |repetitions: u32| {
            for _ in 0..repetitions {
                // SAFETY: both arrays have at least as many elements as told.
                let status = unsafe { set(component, references.as_ptr(), references.len(), values.as_ptr()) };
                assert_eq!(status, 0);
            }
        }
    };
    let (mut model, mut log, mut t) = (Adder::default(), model_description::Silent, 0.0);
    let native_step = move |repetitions: u32| {
        for _ in 0..repetitions {
            let step = Step { t: 0.0, h: 1e-3, input_derivatives: &[] };
            assert!(black_box(&mut model).step(black_box(&step), &mut log).is_ok());
        }
    };
    let fmi_step = move |repetitions: u32| {
        for _ in 0..repetitions {
            // SAFETY: the component is alive.
            assert_eq!(unsafe { do_step(component, t, 1e-3, 1) }, 0);
            t += 1e-3;
        }
    };

    let mut pairs = [
        Pair { name: "fmi2GetReal, 1 value", native: Box::new(native_get(1)), call: Box::new(fmi_get(&sum)) },
        Pair { name: "fmi2GetReal, 83 values", native: Box::new(native_get(83)), call: Box::new(fmi_get(&all)) },
        Pair {
            name: "fmi2GetReal, 83 scattered",
            native: Box::new(native_get(83)),
            call: Box::new(fmi_get(&scattered)),
        },
        Pair { name: "fmi2SetReal, 1 value", native: Box::new(native_set(1)), call: Box::new(fmi_set(&all[..1])) },
        Pair { name: "fmi2SetReal, 83 values", native: Box::new(native_set(83)), call: Box::new(fmi_set(&all)) },
        Pair {
            name: "fmi2SetReal, 83 scattered",
            native: Box::new(native_set(83)),
            call: Box::new(fmi_set(&scattered)),
        },
        Pair { name: "fmi2DoStep", native: Box::new(native_step), call: Box::new(fmi_step) },
    ];
    let times = best(&mut pairs);
    println!("{:<28}{:>12}{:>12}{:>12}", "", "native [ns]", "call [ns]", "above [ns]");
    for (pair, [native, call]) in pairs.iter().zip(times) {
        println!("{:<28}{native:>12.1}{call:>12.1}{:>12.1}", pair.name, call - native);
    }
    drop(pairs);
    // SAFETY: nobody uses the component after this.
    unsafe { fmi2FreeInstance(component) };
}
