#include "extras/machine/channel.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace upswing::machine {
namespace {

constexpr std::array<std::pair<int, speed_t>, 9> kRates{{{115200, B115200},
                                                         {230400, B230400},
                                                         {460800, B460800},
                                                         {500000, B500000},
                                                         {921600, B921600},
                                                         {1000000, B1000000},
                                                         {2000000, B2000000},
                                                         {3000000, B3000000},
                                                         {4000000, B4000000}}};

Error LinkError(const std::string& place, const std::string& what, int error_number) {
  return BadInput(
      Concat("--link ", Printable(place), ": ", what, ": ", std::strerror(error_number)));
}

int ParsePort(std::string_view text, const std::string& link, int lowest) {
  const auto port = ParseInteger(text);
  if (!port || *port < lowest || *port > 65535) {
    throw BadInput(Concat("--link ", Printable(link), ": expected a port from ", lowest,
                          " to 65535, got \"", Printable(text), "\""));
  }
  return static_cast<int>(*port);
}

LinkAddress ParseSerial(std::string place, const std::string& link) {
  LinkAddress address{LinkAddress::Kind::kSerial, std::move(place), kUsualBaud};
  const size_t colon = address.place.rfind(':');
  if (colon != std::string::npos) {
    const auto rate = ParseInteger(address.place.substr(colon + 1));
    address.number = rate ? static_cast<int>(std::clamp<int64_t>(*rate, 0, 1 << 30)) : 0;
    address.place.resize(colon);
  }
  const auto known = [&](const auto& entry) { return entry.first == address.number; };
  if (address.place.empty() || std::ranges::none_of(kRates, known)) {
    std::vector<std::string> names;
    names.reserve(kRates.size());
    for (const auto& [rate, code] : kRates) names.push_back(std::to_string(rate));
    throw BadInput(Concat("--link ", Printable(link), ": expected serial:DEVICE[:BAUD] with BAUD ",
                          Join(names, ", ")));
  }
  return address;
}

void MakeRaw(int fd, speed_t rate, const std::string& place) {
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) throw LinkError(place, "not a terminal", errno);
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  if (cfsetspeed(&settings, rate) != 0 || tcsetattr(fd, TCSANOW, &settings) != 0) {
    throw LinkError(place, "cannot set the terminal's speed", errno);
  }
  tcflush(fd, TCIOFLUSH);
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
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  const int failed =
      getaddrinfo(address.place.c_str(), std::to_string(address.number).c_str(), &hints, &found);
  if (failed != 0) {
    throw BadInput(
        Concat("--link udp:", Printable(place), ": unknown host: ", gai_strerror(failed)));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, freeaddrinfo);
  Descriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0) throw LinkError("udp:" + place, "cannot make a socket", errno);
  const int result = binds ? bind(fd.get(), found->ai_addr, found->ai_addrlen)
                           : connect(fd.get(), found->ai_addr, found->ai_addrlen);
  if (result != 0)
    throw LinkError("udp:" + place, binds ? "cannot listen" : "cannot connect", errno);
  return fd;
}

}  // namespace

LinkAddress ParseLink(const std::string& text, bool listens) {
  using Kind = LinkAddress::Kind;
  if (text.starts_with("udp:")) {
    const std::string place = text.substr(4);
    const size_t colon = place.rfind(':');
    if (colon == std::string::npos && listens) {
      return {Kind::kUdp, "127.0.0.1", ParsePort(place, text, 0)};
    }
    if (colon == std::string::npos || colon == 0) {
      throw BadInput(Concat("--link ", Printable(text), ": expected udp:HOST:PORT"));
    }
    return {Kind::kUdp, place.substr(0, colon),
            ParsePort(std::string_view(place).substr(colon + 1), text, listens ? 0 : 1)};
  }
  if (listens) {
    if (text == "pty") return {Kind::kPty, "pty", 0};
    throw BadInput(
        Concat("--link: expected udp:PORT, udp:HOST:PORT or pty, got \"", Printable(text), "\""));
  }
  if (text.starts_with("serial:")) return ParseSerial(text.substr(7), text);
  return {Kind::kTwin, text, 0};
}

Channel Channel::Connect(const LinkAddress& address) {
  if (address.kind == LinkAddress::Kind::kUdp) {
    Channel channel(OpenUdp(address, /*binds=*/false), true);
    channel.name_ = Concat("udp:", address.place, ":", address.number);
    return channel;
  }
  Descriptor fd(open(address.place.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0) throw LinkError("serial:" + address.place, "cannot open", errno);
  const auto* rate = std::ranges::find(kRates, address.number, [](auto& r) { return r.first; });
  MakeRaw(fd.get(), rate->second, "serial:" + address.place);
  ioctl(fd.get(), TIOCEXCL);  // no second program may write to the motors
  Channel channel(std::move(fd), false);
  channel.name_ = "serial:" + address.place;
  return channel;
}

Channel Channel::Listen(const LinkAddress& address) {
  if (address.kind == LinkAddress::Kind::kUdp) {
    Channel channel(OpenUdp(address, /*binds=*/true), true);
    sockaddr_storage own{};
    socklen_t size = sizeof own;
    getsockname(channel.fd_.get(), reinterpret_cast<sockaddr*>(&own), &size);
    channel.connected_ = false;
    channel.name_ = UdpName(own, size);
    return channel;
  }
  Descriptor fd(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0 || grantpt(fd.get()) != 0 || unlockpt(fd.get()) != 0) {
    throw LinkError("pty", "cannot make a pseudo-terminal", errno);
  }
  std::array<char, 128> name{};
  if (ptsname_r(fd.get(), name.data(), name.size()) != 0) {
    throw LinkError("pty", "cannot name the pseudo-terminal", errno);
  }
  Channel channel(std::move(fd), false);
  channel.name_ = name.data();
  channel.other_end_ = Descriptor(open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  MakeRaw(channel.other_end_.get(), B4000000, channel.name_);
  return channel;
}

bool Channel::Send(std::span<const std::byte> bytes) {
  ssize_t sent = -1;
  if (!datagrams_) {
    sent = write(fd_.get(), bytes.data(), bytes.size());
  } else if (connected_) {
    sent = send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  } else if (peer_size_ > 0) {
    sent = sendto(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL,
                  reinterpret_cast<const sockaddr*>(&peer_), peer_size_);
  }
  return sent == static_cast<ssize_t>(bytes.size());
}

size_t Channel::Receive(std::span<std::byte> buffer) {
  ssize_t got = 0;
  if (datagrams_) {
    sender_size_ = sizeof sender_;
    got = recvfrom(fd_.get(), buffer.data(), buffer.size(), 0,
                   reinterpret_cast<sockaddr*>(&sender_), &sender_size_);
  } else {
    got = read(fd_.get(), buffer.data(), buffer.size());
  }
  // Errors such as a refused packet are ignored, because the age of the last reading shows them.
  return got > 0 ? static_cast<size_t>(got) : 0;
}

void Channel::Wait(double seconds) const {
  pollfd waits{fd_.get(), POLLIN, 0};
  const double limited = std::clamp(seconds, 0.0, 1e6);
  const timespec time{static_cast<time_t>(limited),
                      static_cast<long>((limited - std::floor(limited)) * 1e9)};
  ppoll(&waits, 1, &time, nullptr);
}

void Channel::AnswerSender() {
  peer_ = sender_;
  peer_size_ = sender_size_;
}

}  // namespace upswing::machine
