//! `cargo xtask prove laws [--seeds N] [--minutes M] [--law NAME] [--seed S]`: scenes at random against the laws that no scene may
//! break, on all cores.

use std::{process::Command, time::Duration};

use crate::{
    shell::{Failure, Shell, cargo},
    suites::SLOW,
};

/// Seeds and minutes where nobody asks for others.
const SEEDS: u64 = 100_000;
const MINUTES: u64 = 10;

/// What is asked.
#[derive(Debug, PartialEq)]
struct Asked {
    first: u64,
    seeds: u64,
    minutes: u64,
    law: Option<String>,
}

impl Asked {
    fn of(options: &[String]) -> Result<Self, Failure> {
        let mut asked = Self { first: 0, seeds: SEEDS, minutes: MINUTES, law: None };
        for pair in options.chunks(2) {
            let [option, value] = pair else {
                return Err(Failure(format!("{} needs a value", pair[0])));
            };
            let number = || {
                let wrong = |_| Failure(format!("{option} is '{value}': a whole number is needed"));
                value.parse::<u64>().map_err(wrong)
            };
            match option.as_str() {
                "--seeds" => asked.seeds = number()?,
                "--minutes" => asked.minutes = number()?,
                "--seed" => (asked.first, asked.seeds) = (number()?, 1),
                "--law" => asked.law = Some(value.clone()),
                _ => {
                    let known = "--seeds N, --minutes M, --law NAME, --seed S";
                    return Err(Failure(format!("there is no option '{option}'; there are: {known}")));
                }
            }
        }
        Ok(asked)
    }
}

/// Asks the laws of scenes, as options say.
pub(crate) fn run(shell: &mut Shell, options: &[String]) -> Result<(), Failure> {
    let asked = Asked::of(options)?;
    shell.cargo("laws: build", "test --release --test laws --no-run")?;
    let mut command = Command::new(cargo());
    command.args(["test", "--release", "--test", "laws", "scenes_at_random", "--", "--nocapture"]);
    command.env("NAPPE_LAWS_FIRST", asked.first.to_string());
    command.env("NAPPE_LAWS_SEEDS", asked.seeds.to_string());
    command.env("NAPPE_LAWS_MINUTES", asked.minutes.to_string());
    if let Some(law) = &asked.law {
        command.env("NAPPE_LAWS_LAW", law);
    }
    let patience = SLOW + Duration::from_mins(asked.minutes);
    shell.watched("laws: scenes at random", &mut command, patience)
}

#[cfg(test)]
mod tests {
    use super::Asked;

    fn of(text: &str) -> Result<Asked, String> {
        let options: Vec<_> = text.split_whitespace().map(str::to_owned).collect();
        Asked::of(&options).map_err(|failure| failure.0)
    }

    #[test]
    fn options_say_what_is_asked() {
        let all = of("").expect("nothing is needed");
        assert_eq!((all.first, all.seeds, all.law), (0, 100_000, None));
        let one = of("--law boost --seed 7").expect("options");
        assert_eq!((one.first, one.seeds, one.law.as_deref()), (7, 1, Some("boost")));
        assert_eq!(of("--minutes 60 --seeds 5").map(|asked| (asked.minutes, asked.seeds)), Ok((60, 5)));
        assert!(of("--seeds").is_err() && of("--seeds many").is_err() && of("--years 3").is_err());
    }
}
