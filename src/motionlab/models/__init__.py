"""Recurrent models of motion, one file each.

Each keeps the same contract: ``observe(features)`` gives a state, ``step(x, state)`` goes on by one
frame, ``generate(n, start)`` by many, and what is generative has ``log_prob``. Features are in raw
units, as an encoding makes them; a state is a named tuple of tensors, batch first, so that nothing
is hidden in the model. `Strnn` and `Crbm` have no state, and go on from the last frames; `ConvAutoencoder` says frames again and
goes on with none.
"""

from .aclstm import AcLstm, auto_condition
from .bidirectional_rnn import BidirectionalRnn
from .conv_autoencoder import ConvAutoencoder
from .crbm import Crbm
from .erd import Erd
from .lstm_gmm import LstmGmm, Mixture
from .noise import next_noise
from .refiner import Discriminator, Refiner
from .seq2seq import Seq2Seq
from .state import State
from .strnn import Strnn

__all__ = [
    "AcLstm",
    "BidirectionalRnn",
    "ConvAutoencoder",
    "Crbm",
    "Discriminator",
    "Erd",
    "LstmGmm",
    "Mixture",
    "Refiner",
    "Seq2Seq",
    "State",
    "Strnn",
    "auto_condition",
    "next_noise",
]
