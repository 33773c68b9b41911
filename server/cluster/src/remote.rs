//! Ranks as a server sees them: a simulation at the other end of a link.

use std::{
    io::ErrorKind,
    net::TcpStream,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use nappe_sim::{
    field::Field,
    math::Precision,
    world::{BodySetup, Change, TakenField, WorldSetup, WorldState},
};

use crate::{
    link::{LinkError, Receiver, Sender},
    message::{Answer, Hello, Order, Stepped, VERSION},
    signs::INTERVAL,
    timed::Timed,
};

/// Bytes of an answer that do not grow with the scene: reports of a step, warnings.
const ANSWER_BYTES: u64 = 64 << 20;
/// Bytes of the state of a particle, at most: five vectors of doubles, and what fills up the last sixteen.
const PARTICLE_BYTES: u64 = 256;
/// Bytes of the state of a particle of snow, at most: 34 numbers and its own, and what its grid may take.
const SNOW_PARTICLE_BYTES: u64 = 284 + 2000;
/// Bytes of the state of a law of springs, a pin or a point of its path, at most.
const LAW_BYTES: u64 = 128;
/// Laws of a cloth, at most.
const MOST_LAWS: usize = 1 << 16;

/// A simulation that ranks step.
#[derive(Debug)]
pub struct Remote {
    answers: Timed,
    receiver: Receiver,
    orders: Orders,
    hello: Hello,
    /// How long nothing may be heard of them while they work.
    silence: Duration,
}

/// Where orders are sent; shared by who waits for answers and who may interrupt.
#[derive(Clone, Debug)]
pub struct Orders {
    stream: Timed,
    /// Held while an order is sent.
    turn: Arc<Mutex<Sender>>,
}

/// Why ranks do not step.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// The link failed: a rank is lost.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Who connected showed another token.
    #[error("who connected to the link of the ranks did not show its token")]
    Stranger,
    /// Rank 0 showed the token, and not all of its greeting.
    #[error("rank 0 did not end its greeting within {seconds} s")]
    Late {
        /// How long was waited for it (s).
        seconds: u64,
    },
    /// Nothing is heard of rank 0.
    #[error("no word came from rank 0, on host {host}, for {seconds} s (--rank-silence)")]
    Silent {
        /// The host that rank 0 runs on.
        host: String,
        /// How long was waited for it (s).
        seconds: f64,
    },
    /// Rank 0 lives, and a rank that it waits for says nothing.
    #[error("rank 0, on host {host}, waited {seconds} s (--rank-silence) for a rank on {others}")]
    Waits {
        /// The host of rank 0.
        host: String,
        /// How long it waited (s).
        seconds: f64,
        /// The hosts of the others.
        others: String,
    },
    /// Rank 0 is of another version.
    #[error("the ranks are of version {found}; {VERSION} is needed")]
    Version {
        /// That of rank 0.
        found: String,
    },
    /// Rank 0 answered something else, or ended.
    #[error("rank 0 is gone, or answered out of turn")]
    OutOfTurn,
    /// What the ranks say of a setup or of changes.
    #[error("{0}")]
    Refused(String),
}

impl Orders {
    /// Gives up the step in progress, and all that follow.
    ///
    /// # Errors
    /// When the link fails.
    pub fn interrupt(&self) -> Result<(), LinkError> {
        self.send(&Order::Interrupt)
    }

    /// Closes the link: who waits for an answer waits no longer, and rank 0 aborts the job.
    pub fn cut(&self) {
        self.stream.close();
    }

    fn send(&self, order: &Order) -> Result<(), LinkError> {
        let mut sender = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        sender.send(&mut &self.stream, order)
    }
}

impl Remote {
    /// Takes over the connection of rank 0, which has said who it is.
    ///
    /// # Errors
    /// When the connection has failed meanwhile.
    pub(crate) fn new(
        stream: TcpStream,
        receiver: Receiver,
        hello: Hello,
        silence: Duration,
    ) -> Result<Self, LinkError> {
        stream.set_nodelay(true)?;
        let answers = Timed::new(stream, silence)?;
        let orders = Orders { stream: answers.clone(), turn: Arc::default() };
        Ok(Self { answers, receiver, orders, hello, silence })
    }

    /// What rank 0 said of the job.
    pub fn hello(&self) -> &Hello {
        &self.hello
    }

    /// Where an interrupt is sent from another thread.
    pub fn orders(&self) -> Orders {
        self.orders.clone()
    }

    fn ask(&mut self, order: &Order) -> Result<Answer, RemoteError> {
        if let Err(error) = self.orders.send(order) {
            return Err(self.why(error));
        }
        // How long rank 0 waits in one call, by its own signs: those that came while this process was stopped are read at once.
        let mut waited = Duration::ZERO;
        loop {
            let heard: Result<Option<Answer>, _> = self.receiver.receive(&mut &self.answers);
            let heard = heard.map_err(|error| self.why(error))?;
            match heard.ok_or(RemoteError::OutOfTurn)? {
                Answer::Alive { waits: false } => waited = Duration::ZERO,
                Answer::Alive { waits: true } => waited += INTERVAL,
                answer => return Ok(answer),
            }
            if waited >= self.silence {
                return Err(self.waits());
            }
        }
    }

    /// A link that failed since a time was over is one over which nothing is heard.
    fn why(&self, error: LinkError) -> RemoteError {
        match error {
            LinkError::Io(error) if error.kind() == ErrorKind::TimedOut => {
                RemoteError::Silent { host: self.host(), seconds: self.silence.as_secs_f64() }
            }
            error => error.into(),
        }
    }

    fn waits(&self) -> RemoteError {
        let mut others: Vec<&str> = self.hello.hosts.iter().skip(1).map(String::as_str).collect();
        others.sort_unstable();
        others.dedup();
        let (host, seconds) = (self.host(), self.silence.as_secs_f64());
        RemoteError::Waits { host, seconds, others: others.join(" or ") }
    }

    /// The host of rank 0.
    fn host(&self) -> String {
        self.hello.hosts.first().cloned().unwrap_or_default()
    }

    /// Builds a simulation; the strings are warnings.
    ///
    /// # Errors
    /// What the ranks refuse, or a link that fails.
    pub fn build(&mut self, setup: WorldSetup, precision: Precision) -> Result<Vec<String>, RemoteError> {
        self.receiver.allowed = answer_bytes(&setup);
        match self.ask(&Order::Build(Box::new(setup), precision))? {
            Answer::Built(built) => built.map_err(RemoteError::Refused),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// Applies changes, all or none.
    ///
    /// # Errors
    /// What the ranks refuse, or a link that fails.
    pub fn apply(&mut self, changes: Vec<Change>) -> Result<(), RemoteError> {
        let points: usize = changes.iter().map(Change::weight).sum();
        self.receiver.allowed += LAW_BYTES * points as u64;
        match self.ask(&Order::Apply(changes))? {
            Answer::Applied(applied) => applied.map_err(RemoteError::Refused),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// Takes a step, which may fail as one of a simulation does.
    ///
    /// # Errors
    /// A link that fails.
    pub fn step(&mut self) -> Result<Stepped, RemoteError> {
        match self.ask(&Order::Step)? {
            Answer::Stepped(stepped) => Ok(*stepped),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// What further steps depend on.
    ///
    /// # Errors
    /// A link that fails.
    pub fn take(&mut self) -> Result<WorldState, RemoteError> {
        match self.ask(&Order::Take)? {
            Answer::Taken(state) => Ok(*state),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// Goes on from the state of a simulation of the same setup.
    ///
    /// # Errors
    /// A link that fails.
    pub fn put(&mut self, state: WorldState) -> Result<(), RemoteError> {
        match self.ask(&Order::Put(Box::new(state)))? {
            Answer::Applied(applied) => applied.map_err(RemoteError::Refused),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// A field as it is.
    ///
    /// # Errors
    /// A link that fails.
    pub fn look(&mut self, field: Field) -> Result<TakenField, RemoteError> {
        match self.ask(&Order::Look(field))? {
            Answer::Looked(taken) => Ok(taken),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// Ends the ranks.
    ///
    /// # Errors
    /// A link that fails.
    pub fn end(mut self) -> Result<(), RemoteError> {
        match self.ask(&Order::End)? {
            Answer::Ended => Ok(()),
            _ => Err(RemoteError::OutOfTurn),
        }
    }

    /// The same, waiting no longer than so.
    ///
    /// # Errors
    /// A link that fails, or ranks that do not answer in time.
    pub fn end_within(mut self, patience: Duration) -> Result<(), RemoteError> {
        self.answers.limit = patience;
        self.end()
    }
}

/// Bytes of an answer about a scene, at most.
fn answer_bytes(setup: &WorldSetup) -> u64 {
    let of_cloth = |BodySetup { network, .. }: &BodySetup| {
        let laws = network.springs.len().min(MOST_LAWS) + network.elements.len();
        // A state has room for a multiple of sixteen particles.
        PARTICLE_BYTES * (network.x.len() as u64 + 16) + LAW_BYTES * laws as u64
    };
    // Of snow with the blocks of its grid.
    let particles = setup.snow.iter().flat_map(|snow| &snow.objects).map(|object| object.x.len() as u64);
    let of_snow = particles.map(|count| SNOW_PARTICLE_BYTES * count).sum::<u64>();
    ANSWER_BYTES + setup.bodies.iter().map(of_cloth).sum::<u64>() + of_snow
}
