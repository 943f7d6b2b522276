//! `export_fmu!`: the 34 exported functions.

/// Exports a model as the FMI 2.0 co-simulation slave of a cdylib: the 34 functions of the standard and nothing else.
#[macro_export]
macro_rules! export_fmu {
    ($model:ty) => {
        /// The functions of the C interface, as the FMI 2.0 standard defines them.
        #[allow(
            clippy::missing_safety_doc,
            missing_docs,
            non_snake_case,
            unsafe_code,
            reason = "the standard names, documents and restricts these functions"
        )]
        const _: () = {
            use $crate::abi::*;

            $crate::export_fmu!(@functions $model;
                fmi2SetDebugLogging(on: Boolean, n: usize, categories: *const Text) => set_debug_logging;
                fmi2SetupExperiment(tolerance_defined: Boolean, tolerance: f64, start: f64, stop_defined: Boolean, stop: f64)
                    => setup_experiment;
                fmi2EnterInitializationMode() => enter_initialization_mode;
                fmi2ExitInitializationMode() => exit_initialization_mode;
                fmi2Terminate() => terminate;
                fmi2Reset() => reset;
                fmi2GetReal(vr: *const ValueReference, n: usize, value: *mut f64) => get_real;
                fmi2GetInteger(vr: *const ValueReference, n: usize, value: *mut Integer) => get_integer;
                fmi2GetBoolean(vr: *const ValueReference, n: usize, value: *mut Boolean) => get_boolean;
                fmi2GetString(vr: *const ValueReference, n: usize, value: *mut Text) => get_string;
                fmi2SetReal(vr: *const ValueReference, n: usize, value: *const f64) => set_real;
                fmi2SetInteger(vr: *const ValueReference, n: usize, value: *const Integer) => set_integer;
                fmi2SetBoolean(vr: *const ValueReference, n: usize, value: *const Boolean) => set_boolean;
                fmi2SetString(vr: *const ValueReference, n: usize, value: *const Text) => set_string;
                fmi2GetFMUstate(state: *mut FmuState) => get_fmu_state;
                fmi2SetFMUstate(state: FmuState) => set_fmu_state;
                fmi2FreeFMUstate(state: *mut FmuState) => free_fmu_state;
                fmi2SerializedFMUstateSize(state: FmuState, size: *mut usize) => serialized_fmu_state_size;
                fmi2SerializeFMUstate(state: FmuState, bytes: *mut u8, size: usize) => serialize_fmu_state;
                fmi2DeSerializeFMUstate(bytes: *const u8, size: usize, state: *mut FmuState) => deserialize_fmu_state;
                fmi2GetDirectionalDerivative(unknown: *const ValueReference, n_unknown: usize, known: *const ValueReference,
                    n_known: usize, seed: *const f64, sensitivity: *mut f64) => get_directional_derivative;
                fmi2SetRealInputDerivatives(vr: *const ValueReference, n: usize, order: *const Integer, value: *const f64)
                    => set_real_input_derivatives;
                fmi2GetRealOutputDerivatives(vr: *const ValueReference, n: usize, order: *const Integer, value: *mut f64)
                    => get_real_output_derivatives;
                fmi2DoStep(t: f64, h: f64, no_rollback: Boolean) => do_step;
                fmi2CancelStep() => cancel_step;
                fmi2GetStatus(kind: Integer, value: *mut Integer) => get_status;
                fmi2GetRealStatus(kind: Integer, value: *mut f64) => get_real_status;
                fmi2GetIntegerStatus(kind: Integer, value: *mut Integer) => get_integer_status;
                fmi2GetBooleanStatus(kind: Integer, value: *mut Boolean) => get_boolean_status;
                fmi2GetStringStatus(kind: Integer, value: *mut Text) => get_string_status;
            );

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> Text {
                c"default".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> Text {
                c"2.0".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2Instantiate(
                name: Text, kind: Integer, guid: Text, resources: Text, callbacks: *const Callbacks, visible: Boolean, logging: Boolean,
            ) -> Component {
                // SAFETY: the importer keeps the promises of FMI 2.0.4, section 2.1.5.
                unsafe { instantiate::<$model>(name, kind, guid, resources, callbacks, visible, logging) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2FreeInstance(component: Component) {
                // SAFETY: the importer keeps the promises of FMI 2.0.4, section 2.1.5.
                unsafe { free_instance::<$model>(component) }
            }
        };
    };

    (@functions $model:ty; $($export:ident($($argument:ident: $type:ty),*) => $function:ident;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $export(component: Component $(, $argument: $type)*) -> Status {
            // SAFETY: the importer keeps the promises of FMI 2.0.4 about arguments, section 2.1 and 4.2.
            unsafe { $function::<$model>(component $(, $argument)*) }
        }
    )*};
}
