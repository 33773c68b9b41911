//! Ranks as a server sees them: a simulation at the other end of a link.

use std::{
    net::{Shutdown, TcpStream},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use nappe_sim::{
    math::Precision,
    world::{Change, Positions, WorldSetup, WorldState},
};

use crate::{
    link::{LinkError, receive, send},
    message::{Answer, Hello, Order, Stepped, Token, VERSION},
};

/// A simulation that ranks step.
#[derive(Debug)]
pub struct Remote {
    answers: TcpStream,
    orders: Orders,
    hello: Hello,
}

/// Where orders are sent; shared by who waits for answers and who may interrupt.
#[derive(Clone, Debug)]
pub struct Orders {
    stream: Arc<TcpStream>,
    /// Held while an order is sent.
    turn: Arc<Mutex<()>>,
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
        // It may be closed already.
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    fn send(&self, order: &Order) -> Result<(), LinkError> {
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        send(&mut &*self.stream, order)
    }
}

impl Remote {
    /// Takes over a connection that rank 0 made.
    ///
    /// # Errors
    /// When somebody else connected, or another version.
    pub fn accept(stream: TcpStream, token: Token) -> Result<Self, RemoteError> {
        stream.set_nodelay(true).map_err(LinkError::from)?;
        let sending = stream.try_clone().map_err(LinkError::from)?;
        let orders = Orders { stream: Arc::new(sending), turn: Arc::default() };
        let mut answers = stream;
        let hello: Hello = receive(&mut answers)?.ok_or(RemoteError::OutOfTurn)?;
        if hello.token != token {
            return Err(RemoteError::Stranger);
        }
        if hello.version != VERSION {
            return Err(RemoteError::Version { found: hello.version });
        }
        Ok(Self { answers, orders, hello })
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
        self.orders.send(order)?;
        receive(&mut self.answers)?.ok_or(RemoteError::OutOfTurn)
    }

    /// Builds a simulation; the strings are warnings.
    ///
    /// # Errors
    /// What the ranks refuse, or a link that fails.
    pub fn build(&mut self, setup: WorldSetup, precision: Precision) -> Result<Vec<String>, RemoteError> {
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

    /// Where particles are.
    ///
    /// # Errors
    /// A link that fails.
    pub fn look(&mut self) -> Result<Positions, RemoteError> {
        match self.ask(&Order::Look)? {
            Answer::Looked(positions) => Ok(positions),
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
    pub fn end_within(self, patience: Duration) -> Result<(), RemoteError> {
        self.answers.set_read_timeout(Some(patience)).map_err(LinkError::from)?;
        self.end()
    }
}
