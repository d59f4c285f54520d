// Windows has no links yet: every channel is refused when it is asked for, with a line that says
// so.
#include "base/error.h"
#include "base/text.h"
#include "extras/machine/drive/channel.h"

namespace upswing::machine {
namespace {

Error Missing(const LinkAddress& address) {
  return BadInput(Concat("--link ", Printable(address.place),
                         ": expected the file of a twin, because UDP and serial links exist on "
                         "Linux only; on Windows use WSL"));
}

}  // namespace

struct Channel::Line {};

Channel::Channel(Channel&&) noexcept = default;
Channel::~Channel() = default;

Channel Channel::Connect(const LinkAddress& address) { throw Missing(address); }
Channel Channel::Listen(const LinkAddress& address) { throw Missing(address); }

// There is no channel that these could be called on.
bool Channel::Send(std::span<const std::byte> /*bytes*/) { return false; }
size_t Channel::Receive(std::span<std::byte> /*buffer*/) { return 0; }
void Channel::Wait(double /*seconds*/) const {}
void Channel::AnswerSender() {}

}  // namespace upswing::machine
