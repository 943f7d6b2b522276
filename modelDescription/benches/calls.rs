//! Does a call through the C interface cost at most 100 ns more than the same thing done natively?
//!
//! The model is as cheap as a model can be, so what is measured is the interface. Pairs of rows "native" and "fmi2..." belong together;
//! the FMI functions are called through pointers that the compiler cannot see through, as an importer calls them.
#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::hint::black_box;
use std::ptr;

use criterion::{Criterion, criterion_group, criterion_main};
use model_description::{Experiment, Info, Log, Model, Outcome, Step, Table, variables};
use serde::{Deserialize, Serialize};

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

fn calls(criterion: &mut Criterion) {
    let component = instance();
    let (get, set, do_step): (Get, Set, DoStep) = black_box((fmi2GetReal, fmi2SetReal, fmi2DoStep));
    let mut model = Adder::default();
    let (sum, mut value) = (83, 0.0);
    let all: Vec<c_uint> = (0..83).collect();
    let mut values = vec![0.5; 83];

    let mut group = criterion.benchmark_group("get 1");
    group.bench_function("native", |b| b.iter(|| black_box(&model).sum));
    group.bench_function("fmi2GetReal", |b| b.iter(|| unsafe { get(component, &raw const sum, 1, &raw mut value) }));
    group.finish();

    let mut group = criterion.benchmark_group("get 83");
    group
        .bench_function("fmi2GetReal", |b| b.iter(|| unsafe { get(component, all.as_ptr(), 83, values.as_mut_ptr()) }));
    group.finish();

    let mut group = criterion.benchmark_group("set 1");
    group.bench_function("native", |b| b.iter(|| black_box(&mut model).u = black_box(0.5)));
    group.bench_function("fmi2SetReal", |b| b.iter(|| unsafe { set(component, all.as_ptr(), 1, values.as_ptr()) }));
    group.finish();

    let mut group = criterion.benchmark_group("set 83");
    group.bench_function("fmi2SetReal", |b| b.iter(|| unsafe { set(component, all.as_ptr(), 83, values.as_ptr()) }));
    group.finish();

    let mut group = criterion.benchmark_group("step");
    let step = Step { t: 0.0, h: 1e-3, input_derivatives: &[] };
    let mut log = model_description::Silent;
    group.bench_function("native", |b| b.iter(|| black_box(&mut model).step(black_box(&step), &mut log)));
    let mut t = 0.0;
    group.bench_function("fmi2DoStep", |b| {
        b.iter(|| {
            assert_eq!(unsafe { do_step(component, t, 1e-3, 1) }, 0);
            t += 1e-3;
        });
    });
    group.finish();

    unsafe { fmi2FreeInstance(component) };
}

criterion_group!(benches, calls);
criterion_main!(benches);
