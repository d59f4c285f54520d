#include <filesystem>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/drive/channel.h"

namespace upswing::machine {
namespace {

constexpr int kLeastBaud = 1200, kMostBaud = 1 << 30;

int ParsePort(std::string_view text, const std::string& link, int lowest) {
  const auto port = ParseInteger(text);
  if (!port || *port < lowest || *port > 65535) {
    throw BadInput(Concat("--link ", Printable(link), ": expected a port from ", lowest,
                          " to 65535, got \"", Printable(text), "\""));
  }
  return static_cast<int>(*port);
}

LinkAddress ParseSerial(std::string place, const std::string& link) {
  LinkAddress address{LinkAddress::Transport::kSerial, std::move(place), kUsualBaud};
  bool is_valid = true;
  const size_t colon = address.place.rfind(':');
  if (colon != std::string::npos) {
    const auto rate = ParseInteger(address.place.substr(colon + 1));
    address.place.resize(colon);
    if (!rate || *rate < kLeastBaud) {
      is_valid = false;
    } else if (*rate > kMostBaud) {
      address.number = kMostBaud;
    } else {
      address.number = static_cast<int>(*rate);
    }
  }
  if (!is_valid || address.place.empty()) {
    throw BadInput(Concat("--link ", Printable(link), ": expected serial:DEVICE[:BAUD] with BAUD ",
                          kLeastBaud, " or more, such as ", kUsualBaud));
  }
  return address;
}

}  // namespace

LinkAddress ParseLink(const std::string& text, bool listens) {
  using Transport = LinkAddress::Transport;
  if (text.starts_with("udp:")) {
    const std::string place = text.substr(4);
    const size_t colon = place.rfind(':');
    if (colon == std::string::npos && listens) {
      return {Transport::kUdp, "127.0.0.1", ParsePort(place, text, 0)};
    }
    if (colon == std::string::npos || colon == 0) {
      throw BadInput(Concat("--link ", Printable(text), ": expected udp:HOST:PORT"));
    }
    std::string host = place.substr(0, colon);
    const bool in_brackets = host.starts_with('[') && host.ends_with(']');
    if (in_brackets) host = host.substr(1, host.size() - 2);
    if (!in_brackets && host.find(':') != std::string::npos) {
      throw BadInput(Concat("--link ", Printable(text),
                            ": expected an IPv6 address in brackets, udp:[ADDRESS]:PORT"));
    }
    return {Transport::kUdp, host,
            ParsePort(std::string_view(place).substr(colon + 1), text, listens ? 0 : 1)};
  }
  if (listens) {
    if (text == "pty") return {Transport::kPty, "pty", 0};
    throw BadInput(
        Concat("--link: expected udp:PORT, udp:HOST:PORT or pty, got \"", Printable(text), "\""));
  }
  if (text.starts_with("serial:")) return ParseSerial(text.substr(7), text);
  if (text.starts_with("tcp:")) {
    throw BadInput(Concat("--link ", Printable(text), ": expected udp:HOST:PORT; TCP would repeat ",
                          "old commands"));
  }
  if (text.starts_with("/dev/")) return ParseSerial(text, text);
  // A plant file has no colon, unless a folder has one.
  const size_t colon = text.rfind(':');
  if (colon != std::string::npos && !std::filesystem::exists(text)) {
    throw BadInput(Concat("--link: expected udp:HOST:PORT, serial:DEVICE or a plant file, got \"",
                          Printable(text), "\""));
  }
  return {Transport::kTwin, text, 0};
}

}  // namespace upswing::machine
