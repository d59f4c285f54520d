#include <arpa/inet.h>
#include <asm/termbits.h>  // termios2, which glibc's <termios.h> excludes
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/drive/channel.h"
#include "os/making.h"

namespace upswing::machine {
namespace {

Error LinkError(const std::string& place, const std::string& what, int error_number) {
  return BadInput(
      Concat("--link ", Printable(place), ": ", what, ": ", std::strerror(error_number)));
}

/// Sets a terminal to raw bytes (8 data bits, no parity, no flow control) at any rate (bit/s).
void MakeRaw(int fd, int rate, const std::string& place) {
  termios2 settings{};
  if (ioctl(fd, TCGETS2, &settings) != 0) throw LinkError(place, "not a terminal", errno);
  settings.c_iflag = settings.c_oflag = settings.c_lflag = 0;
  settings.c_cflag = CS8 | CLOCAL | CREAD | BOTHER;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(rate);
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  if (ioctl(fd, TCSETS2, &settings) != 0) {
    throw LinkError(place, Concat("cannot set ", rate, " bit/s"), errno);
  }
  ioctl(fd, TCFLSH, TCIOFLUSH);
}

std::string UdpName(const sockaddr_storage& address, socklen_t size) {
  std::array<char, 64> host{}, port{};
  getnameinfo(reinterpret_cast<const sockaddr*>(&address), size, host.data(), host.size(),
              port.data(), port.size(), NI_NUMERICHOST | NI_NUMERICSERV);
  return Concat("udp:", host.data(), ":", port.data());
}

/// A UDP socket that is bound to the address, or connected to it.
Descriptor OpenUdp(const LinkAddress& address, bool binds) {
  const std::string place = Concat(address.place, ":", address.number);
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int failed =
      getaddrinfo(address.place.c_str(), std::to_string(address.number).c_str(), &hints, &found);
  if (failed != 0) {
    throw BadInput(
        Concat("--link udp:", Printable(place), ": unknown host: ", gai_strerror(failed)));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, freeaddrinfo);
  Descriptor fd(socket(found->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0) throw LinkError("udp:" + place, "cannot make a socket", errno);
  const int result = binds ? bind(fd.get(), found->ai_addr, found->ai_addrlen)
                           : connect(fd.get(), found->ai_addr, found->ai_addrlen);
  if (result != 0)
    throw LinkError("udp:" + place, binds ? "cannot listen" : "cannot connect", errno);
  return fd;
}

/// Whether the device at the other end of a terminal is gone.
bool HasHungUp(int fd) {
  pollfd event{fd, POLLIN, 0};
  if (poll(&event, 1, 0) <= 0) return false;
  return (event.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

}  // namespace

/// The open socket or terminal.
struct Channel::Line {
  Descriptor fd{-1};
  Descriptor other_end{-1};  // of a pseudo-terminal, which stays open between two users
  sockaddr_storage sender{}, peer{};
  socklen_t sender_size = 0, peer_size = 0;
};

Channel::Channel(Line line, bool datagrams, std::string name)
    : line_(std::make_unique<Line>(std::move(line))),
      datagrams_(datagrams),
      name_(std::move(name)) {}
Channel::Channel(Channel&&) noexcept = default;
Channel::~Channel() = default;

Channel Channel::Connect(const LinkAddress& address) {
  if (address.transport == LinkAddress::Transport::kUdp) {
    return {Line{OpenUdp(address, /*binds=*/false)}, true,
            Concat("udp:", address.place, ":", address.number)};
  }
  const std::string name = "serial:" + address.place;
  Descriptor fd(open(address.place.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0) {
    const int error = errno;
    std::string what = "cannot open";
    if (error == EACCES) what += "; `sudo usermod -aG dialout $USER` and a new login permit it";
    if (error == EBUSY) what = "another program uses it";
    throw LinkError(name, what, error);
  }
  MakeRaw(fd.get(), address.number, name);
  ioctl(fd.get(), TIOCEXCL);  // no second program may write to the motors
  return {Line{std::move(fd)}, false, name};
}

Channel Channel::Listen(const LinkAddress& address) {
  if (address.transport == LinkAddress::Transport::kUdp) {
    Descriptor fd = OpenUdp(address, /*binds=*/true);
    sockaddr_storage own{};
    socklen_t size = sizeof own;
    getsockname(fd.get(), reinterpret_cast<sockaddr*>(&own), &size);
    return {Line{std::move(fd)}, true, UdpName(own, size)};
  }
  Descriptor fd(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0 || grantpt(fd.get()) != 0 || unlockpt(fd.get()) != 0) {
    throw LinkError("pty", "cannot make a pseudo-terminal", errno);
  }
  std::array<char, 128> name{};
  if (ptsname_r(fd.get(), name.data(), name.size()) != 0) {
    throw LinkError("pty", "cannot name the pseudo-terminal", errno);
  }
  Channel channel(Line{std::move(fd)}, false, name.data());
  channel.line_->other_end = Descriptor(open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  MakeRaw(channel.line_->other_end.get(), 4000000, channel.name_);
  return channel;
}

bool Channel::Send(std::span<const std::byte> bytes) {
  ssize_t sent = 0;
  if (datagrams_) {
    // A socket without a peer sends to what it is connected to, else nowhere.
    const auto* peer =
        line_->peer_size > 0 ? reinterpret_cast<const sockaddr*>(&line_->peer) : nullptr;
    sent =
        sendto(line_->fd.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, peer, line_->peer_size);
  } else {
    sent = write(line_->fd.get(), bytes.data(), bytes.size());
  }
  return sent == static_cast<ssize_t>(bytes.size());
}

size_t Channel::Receive(std::span<std::byte> buffer) {
  ssize_t got = 0;
  if (datagrams_) {
    line_->sender_size = sizeof line_->sender;
    got = recvfrom(line_->fd.get(), buffer.data(), buffer.size(), 0,
                   reinterpret_cast<sockaddr*>(&line_->sender), &line_->sender_size);
  } else {
    got = read(line_->fd.get(), buffer.data(), buffer.size());
  }
  if (got > 0) return static_cast<size_t>(got);
  // A device that was pulled out hangs up. Errors such as a refused packet are ignored, because the
  // age of the last reading shows them.
  const bool is_device = !datagrams_ && line_->other_end.get() < 0;
  if (is_device) {
    const bool failed = got < 0 && errno != EAGAIN && errno != EINTR;
    if (failed || HasHungUp(line_->fd.get())) {
      throw Failure(Concat("--link ", Printable(name_), ": disconnected"));
    }
  }
  return 0;
}

void Channel::Wait(double seconds) const {
  pollfd waits{line_->fd.get(), POLLIN, 0};
  const double limited = std::clamp(seconds, 0.0, 1e6);
  const timespec time{static_cast<time_t>(limited),
                      static_cast<long>((limited - std::floor(limited)) * 1e9)};
  ppoll(&waits, 1, &time, nullptr);
}

void Channel::AnswerSender() {
  line_->peer = line_->sender;
  line_->peer_size = line_->sender_size;
}

}  // namespace upswing::machine
