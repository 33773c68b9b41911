//! `cargo xtask prove builds`, second half: no kernel calls an intrinsic.
//!
//! An intrinsic is one instruction, unless the function that uses it was not compiled for that instruction: then it is a
//! call, and each pack goes through memory. A closure is such a function (rust-lang/rust#111836), and tests of results do
//! not notice.

use std::process::Command;

use crate::shell::{Failure, Shell, cargo};

/// The program that is looked at: every kernel is in it, by its name.
const PROGRAM: &str = "test --release -p nappe-tests --test determinism --no-run --message-format=json";

/// What the name of every intrinsic has in it.
const INTRINSICS: &str = "core_arch";

/// What asks the processor which instructions it has, by an intrinsic, is no kernel.
const DETECTION: &str = "std_detect";

/// Looks at the machine code of the numerics.
pub(crate) fn prove(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("machine code: no intrinsic is called", |shell| {
        let told = shell.printed(Command::new(cargo()).args(PROGRAM.split_whitespace()))?;
        let program =
            told.lines().find_map(executable).ok_or(Failure(format!("cargo {PROGRAM}: no program")))?;
        let code =
            shell.printed(Command::new("objdump").args(["--disassemble", "--no-show-raw-insn", program]))?;
        let functions = code.lines().filter(|line| line.ends_with(">:")).count();
        if functions < 1000 {
            return Err(Failure(format!("objdump names {functions} functions: too few to look at")));
        }
        let callers = callers(&code);
        if callers.is_empty() { Ok(()) } else { Err(Failure(callers.join("\n"))) }
    })
}

/// The program that a message of cargo names.
fn executable(message: &str) -> Option<&str> {
    Some(message.split_once("\"executable\":\"")?.1.split_once('"')?.0)
}

/// Every function that calls an intrinsic, and the call.
fn callers(code: &str) -> Vec<String> {
    let (mut function, mut callers) = ("", Vec::new());
    for line in code.lines() {
        if line.ends_with(">:") {
            function = line;
        } else if line.contains("call") && line.contains(INTRINSICS) && !function.contains(DETECTION) {
            callers.push(format!("{function}{line}"));
        }
    }
    callers
}

#[cfg(test)]
mod tests {
    use super::callers;

    #[test]
    fn a_call_of_an_intrinsic_is_found_and_one_of_another_function_is_not() {
        let code = "0000 <kernel>:\n  5:\tcall   80 <_4core9core_arch3x863avx14__mm256_set1_pd>\n0000 <other>:\n  5:\tcall   70 <memcpy>\n";
        assert_eq!(callers(code).len(), 1);
        assert!(callers(code)[0].contains("kernel"));
    }
}
