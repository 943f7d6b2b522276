//! Driving allocates nothing: counted by the allocator itself.

mod driver;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use driver::{T_S, command, vehicle};
use vehicle::{Inputs, Parameters};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// Counts the allocations of the test's own thread.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn steps_and_outputs_do_not_allocate() {
    let everything = Parameters {
        delay_delta: 0.05,
        delay_a_x: 0.03,
        tau_delta: 0.05,
        delta_rate_max: 0.5,
        noise_scale: 1.0,
        load_transfer: true,
        combined_slip: true,
        relaxation_length: 0.3,
        gust_speed: 5.0,
        patch_length: 10.0,
        grade: 0.01,
        ..Parameters::default()
    };
    for parameters in [Parameters::default(), everything] {
        for road in vehicle::road::NAMES {
            let original = vehicle(road, parameters.clone());
            // A restored copy must be as quiet as the original.
            for mut vehicle in [original.clone(), original] {
                let before = ALLOCATIONS.get();
                for step in 0..200_u32 {
                    let inputs = command(&vehicle);
                    let rates = Inputs { delta: 0.01, ..Inputs::ZERO };
                    let done = if step % 2 == 0 {
                        vehicle.advance(T_S, &inputs)
                    } else {
                        vehicle.advance_along(1e-3, &inputs, &rates)
                    };
                    done.unwrap();
                    std::hint::black_box((
                        vehicle.measurement(),
                        vehicle.outputs_rate(&inputs),
                        vehicle.preview_rate(),
                    ));
                    std::hint::black_box(vehicle.outputs_along(&inputs, &rates));
                }
                assert_eq!(ALLOCATIONS.get() - before, 0, "{road}");
            }
        }
    }
}
